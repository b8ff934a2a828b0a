#include "retarget/choose_lattice.h"

#include <gtest/gtest.h>

#include <optional>

#include "shapes.h"

namespace hydrostat::retarget::choose_lattice_test {
namespace {

TEST(FittedLattice, SpansTheBoxExactly) {
  const SkinnedMesh skin = box_skin({-1, 0.5, 2}, {0.2, 1.25, 5});
  const Lattice lattice = fitted_lattice(skin, {3, 2, 6}, 10);
  EXPECT_LT((lattice.origin - Eigen::Vector3d(-1, 0.5, 2)).norm(), 1e-15);
  EXPECT_LT(
      (lattice.origin + lattice.cell_size.cwiseProduct(lattice.cells.cast<double>()) - Eigen::Vector3d(0.2, 1.25, 5)).norm(),
      1e-14);
}

TEST(FittedLattice, LaysASheetInTheMiddleOfItsLayerOrOnItsBottom) {
  const Lattice upright = fitted_lattice(box_skin({0, 0, 0.5}, {1, 1, 0.5}), {4, 4, 1}, 10);
  EXPECT_NEAR(upright.cell_size[2], 0.75 * 0.25, 1e-15);
  EXPECT_NEAR(upright.origin[2] + 0.5 * upright.cell_size[2], 0.5, 1e-15);
  const Lattice lying = fitted_lattice(box_skin({0, 0.5, 0}, {1, 0.5, 1}), {4, 1, 4}, 10);
  EXPECT_EQ(lying.origin[1], 0.5);
}

TEST(RankedLattices, AreNearCubesWithTheWantedNodesFirst) {
  const SkinnedMesh brick = box_skin({0, 0, 0}, {0.3, 0.7, 1.2});
  const TriangleSoup closed = with_closed_holes(brick.vertices, brick.triangles);
  for (const int wanted : {60, 150, 400}) {
    SCOPED_TRACE(wanted);
    const std::vector<LatticeBody> lattices = ranked_lattices(brick, closed, {.nodes = wanted});
    ASSERT_FALSE(lattices.empty());
    for (const LatticeBody& lattice : lattices) {
      const Eigen::Vector3d& size = lattice.cell_size;
      EXPECT_LE(size.maxCoeff(), 1.4 * size.minCoeff() * (1 + 1e-9));
    }
    EXPECT_NEAR(1.0 * (lattices[0].cells.array() + 1).prod() / wanted, 1, 0.2);  // a full brick uses every node
  }
}

TEST(RankedLattices, OfAMirrorImageOfItselfAreNotThreeCellsAcross) {
  for (const int across : {0, 2}) {
    SCOPED_TRACE(across);
    Eigen::Vector3d size(0.45, 0.47, 0.45);
    size[2 - across] = 3;
    const SkinnedMesh worm = box_skin({0, 0, 0}, size);
    const TriangleSoup closed = with_closed_holes(worm.vertices, worm.triangles);
    const auto first = [&](std::optional<int> mirror_axis) {
      return ranked_lattices(worm, closed, {.nodes = 330, .mirror_axis = mirror_axis}).at(0).cells;
    };
    EXPECT_EQ(first(std::nullopt)[across], 3);
    EXPECT_EQ(first(across)[across] % 2, 0);
    EXPECT_EQ(first(2 - across)[across], 3) << "what lies along matters not";
  }
}

TEST(Misfit, PrefersFullCubesOfTheWantedNumber) {
  const Eigen::Vector3d cube(1, 1, 1), slab(1, 1.3, 1);
  for (const int wanted : {0, 200}) {
    const BodyOptions options{.nodes = wanted};
    const auto of = [&](double nodes, double fill, const Eigen::Vector3d& cell_size) {
      return misfit({{4, 4, 7}, cell_size, nodes, fill}, options);
    };
    const double best = of(200, 1, cube);
    EXPECT_NEAR(best, 0, 1e-15);
    EXPECT_GT(of(200, 0.7, cube), best);
    EXPECT_GT(of(200, 1, slab), best);
    EXPECT_GT(of(150, 1, cube), best);
    EXPECT_GT(of(300, 1, cube), best);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::choose_lattice_test

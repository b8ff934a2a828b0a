#include "retarget/cut_into_tets.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <map>
#include <random>

namespace hydrostat::retarget::cut_into_tets_test {
namespace {

/// A part in each cell of the grid, linked to all its neighbours.
BodyParts full_block(const Grid& cells) {
  BodyParts body;
  for (int c = 0; c < cells.count(); ++c) {
    body.parts.push_back({c, 1});
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3i next = cells.place(c);
      next[axis] += 1;
      if (cells.holds(next)) body.links.insert({c, cells.index(next), axis});
    }
  }
  return body;
}

ControlMesh cut(const Lattice& lattice, const BodyParts& body) {
  ControlMesh mesh;
  cut_into_tets(lattice, number_cells({lattice.cells}, body), mesh);
  return mesh;
}

double volume(const ControlMesh& mesh) {
  double sum = 0;
  for (const auto tet : mesh.tets.colwise()) {
    Eigen::Matrix3d spans;
    for (int k = 0; k < 3; ++k) spans.col(k) = mesh.nodes.col(tet[k + 1]) - mesh.nodes.col(tet[0]);
    EXPECT_GT(spans.determinant(), 0);
    sum += spans.determinant() / 6;
  }
  return sum;
}

TEST(CutIntoTets, FillsABlockWithoutGapOrOverlap) {
  const Lattice lattice{{-1, 0, 2}, {0.5, 0.25, 0.125}, {3, 2, 4}};
  const ControlMesh mesh = cut(lattice, full_block({lattice.cells}));
  EXPECT_EQ(mesh.node_count(), 4 * 3 * 5);
  EXPECT_EQ(mesh.pieces, 1);
  EXPECT_EQ(mesh.copied_cells, 0);
  EXPECT_NEAR(volume(mesh), 1.5 * 0.5 * 0.5, 1e-14);
  std::map<std::array<int, 3>, int> uses;  // of each face
  for (const auto tet : mesh.tets.colwise()) {
    for (int k = 0; k < 4; ++k) {
      std::array<int, 3> face{tet[(k + 1) % 4], tet[(k + 2) % 4], tet[(k + 3) % 4]};
      std::sort(face.begin(), face.end());
      ++uses[face];
    }
  }
  const auto outer = std::count_if(uses.begin(), uses.end(), [](const auto& entry) { return entry.second == 1; });
  EXPECT_EQ(outer, 2 * 2 * (3 * 2 + 2 * 4 + 4 * 3));  // two triangles a square: the diagonals of common faces agree
  for (const auto& [face, count] : uses) EXPECT_LE(count, 2);
}

TEST(CutIntoTets, CellsThatAreNotLinkedShareNoNode) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Lattice lattice{Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {7, 1, 1}};
    BodyParts body = full_block({lattice.cells});
    const int parted = std::uniform_int_distribution(0, 5)(random);
    body.links.erase({parted, parted + 1, 0});
    const ControlMesh mesh = cut(lattice, body);
    EXPECT_EQ(mesh.pieces, 2);
    EXPECT_EQ(mesh.node_count(), 4 * (parted + 2) + 4 * (7 - parted));
    EXPECT_NEAR(volume(mesh), 7, 1e-12);
  }
}

TEST(CutIntoTets, TwoPartsOfACellAreCopiesInOnePlace) {
  const Lattice lattice{Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {1, 1, 1}};
  BodyParts body;
  body.parts = {{0, 0.3}, {0, 0.01}, {0, 0.5, /*kept=*/false}};
  const ControlMesh mesh = cut(lattice, body);
  EXPECT_EQ(mesh.cells, 2);
  EXPECT_EQ(mesh.copied_cells, 1);
  EXPECT_EQ(mesh.node_count(), 16);
  EXPECT_EQ(mesh.cell_places.col(0), mesh.cell_places.col(1));
  EXPECT_EQ(mesh.tet_fill[0], 0.3);
  EXPECT_EQ(mesh.tet_fill[5], 0.05);  // the least that still has mass
}

}  // namespace
}  // namespace hydrostat::retarget::cut_into_tets_test

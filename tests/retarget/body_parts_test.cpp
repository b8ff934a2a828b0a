#include "retarget/body_parts.h"

#include <gtest/gtest.h>

#include <random>

#include "retarget/choose_lattice.h"
#include "retarget/disjoint_sets.h"
#include "shapes.h"

namespace hydrostat::retarget::body_parts_test {
namespace {

BodyVoxels voxels_of(const SkinnedMesh& skin, const Eigen::Vector3i& cells) {
  return body_voxels(skin, with_closed_holes(skin.vertices, skin.triangles), fitted_lattice(skin, cells, 10));
}

int parts_in(const BodyParts& body, int cell) {
  return static_cast<int>(
      std::count_if(body.parts.begin(), body.parts.end(), [&](const Part& part) { return part.cell == cell; }));
}

TEST(DisjointSets, AreThoseOfTheJoinsInAnyOrder) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> number(0, 29);
    std::vector<std::pair<int, int>> joins;
    for (int i = 0; i < 20; ++i) joins.emplace_back(number(random), number(random));
    std::vector<int> expected(30);  // the least number that can be reached
    std::iota(expected.begin(), expected.end(), 0);
    for (int round = 0; round < 30; ++round) {
      for (const auto& [a, b] : joins) at(expected, a) = at(expected, b) = std::min(at(expected, a), at(expected, b));
    }
    std::shuffle(joins.begin(), joins.end(), random);
    DisjointSets sets(30);
    int count = 30;
    for (const auto& [a, b] : joins) count -= sets.join(a, b);
    for (int i = 0; i < 30; ++i) EXPECT_EQ(sets.root(i), at(expected, i));
    EXPECT_EQ(count, static_cast<int>(std::set<int>(expected.begin(), expected.end()).size()));
  }
}

TEST(BodyVoxels, BelongToTheBoneOfTheSkinAroundThem) {
  const Character body = two_legged(0.1);
  const BodyVoxels voxels = voxels_of(body.skin, {3, 5, 1});
  for (const double side : {1.0, -1.0}) {
    const int voxel = voxels.voxel_at({side * 0.2, 0.3, 0.15});  // in the middle of a leg
    EXPECT_EQ(at(voxels.state, voxel), Voxel::inside);
    EXPECT_EQ(at(voxels.bone, voxel), side > 0 ? 2 : 4);
    EXPECT_LT((voxels.middle(voxel) - Eigen::Vector3d(side * 0.2, 0.3, 0.15)).cwiseAbs().maxCoeff(),
              0.5 * voxels.lattice.voxel_size().maxCoeff() + 1e-12);
  }
  const int air = voxels.voxel_at({0, 0.3, 0.15});
  EXPECT_FALSE(voxels.is_body(air));
  EXPECT_EQ(at(voxels.bone, air), kNone);
}

TEST(FindParts, LegsInOneCellAreTwoPartsAndTheBeamAboveIsOne) {
  for (const double gap : {0.0, 0.03, 0.1}) {  // [m]; without a gap the bones alone tell the legs apart
    SCOPED_TRACE("gap " + std::to_string(gap) + " m");
    const Character body = two_legged(gap);
    const BodyVoxels voxels = voxels_of(body.skin, {3, 5, 1});
    const BodyParts parts = find_parts(voxels, bones_of_different_limbs(body.skeleton));
    for (const int row : {0, 1, 2}) EXPECT_EQ(parts_in(parts, voxels.cells.index({1, row, 0})), 2) << "row " << row;
    EXPECT_EQ(parts_in(parts, voxels.cells.index({1, 4, 0})), 1);
  }
}

TEST(FindParts, FillIsTheVolumeOfTheSkin) {
  const SkinnedMesh ball = ball_skin({0.5, 0.5, 0.5});
  const BodyVoxels voxels = voxels_of(ball, {4, 4, 4});
  const BodyParts parts = find_parts(voxels, bones_of_different_limbs(one_bone()));
  double volume = 0;
  for (const Part& part : parts.parts) volume += part.fill * voxels.lattice.cell_size.prod();
  EXPECT_NEAR(volume, std::numbers::pi / 6, 0.03 * 0.5236);  // [m³]
}

TEST(PartsOfVertices, AreTheirOwnLimbs) {
  const Character body = two_legged(0.03);
  const BodyVoxels voxels = voxels_of(body.skin, {3, 5, 1});
  const LimbTable limbs = bones_of_different_limbs(body.skeleton);
  const BodyParts parts = find_parts(voxels, limbs);
  const std::vector<int> vertex_parts = parts_of_vertices(voxels, parts, limbs, body.skin);
  std::set<int> left, right;
  for (int v = 0; v < body.skin.vertices.cols(); ++v) {
    if (body.skin.vertices(1, v) > 0.55) continue;
    ASSERT_NE(at(vertex_parts, v), kNone);
    (at(body.skin.skin_weights, v)[0].bone == 2 ? left : right).insert(at(vertex_parts, v));
  }
  EXPECT_FALSE(left.empty() || right.empty());
  for (const int part : left) EXPECT_FALSE(right.count(part));
}

TEST(DropSlivers, LeavesOutALayerAsThinAsTheLeastFillAlone) {
  for (const double beyond : {0.02, 0.2}) {  // [m] that a lid reaches into the second cell
    SCOPED_TRACE(beyond);
    const SkinnedMesh box = box_skin({0, 0, 0}, {1, 1, 1 + beyond});
    const BodyVoxels voxels = body_voxels(box, {box.vertices, box.triangles}, {{0, 0, 0}, {1, 1, 1}, {1, 1, 2}});
    const LimbTable limbs = bones_of_different_limbs(one_bone());
    BodyParts parts = find_parts(voxels, limbs);
    ASSERT_EQ(parts.count(), 2);
    drop_slivers(voxels, parts_of_vertices(voxels, parts, limbs, box), box, 0.06, parts);
    EXPECT_TRUE(parts.parts[0].kept);
    EXPECT_EQ(parts.parts[1].kept, beyond > 0.06);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::body_parts_test

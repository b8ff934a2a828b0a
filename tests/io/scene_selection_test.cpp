#include "io/scene_selection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "io/capsules.h"
#include "io/rig.h"
#include "io/scene_axes.h"
#include "retarget/error.h"

namespace hydrostat::io::scene_selection_test {
namespace {

SceneNode node(const std::string& name, int parent, bool is_joint) {
  SceneNode result;
  result.name = name;
  result.parent = parent;
  result.parts = {Eigen::Affine3d(Eigen::Translation3d(0, 1, 0))};
  result.is_joint = is_joint;
  return result;
}

SceneMesh triangle(const std::string& name, int on, std::vector<int> joints) {
  SceneMesh mesh;
  mesh.name = name;
  mesh.node = on;
  mesh.vertices = Eigen::Matrix3d::Identity();
  mesh.triangles = Eigen::Vector3i(0, 1, 2);
  for (const int joint : joints) mesh.joints.push_back({joint, Eigen::Affine3d::Identity(), {{0, 1.0}, {1, 1.0}, {2, 1.0}}});
  return mesh;
}

/// Two characters under one root: a horse of two meshes, whose hoof hangs on a bone of its own beside the spine, and its
/// rider.
Scene horse_and_rider() {
  Scene scene;
  scene.nodes = {node("world", -1, false), node("horse", 0, false), node("spine", 1, true), node("hoof", 1, true),
                 node("rider", 0, false),  node("hips", 4, true),   node("hand", 5, true)};
  scene.meshes = {triangle("coat", 0, {2}), triangle("iron", 0, {3}), triangle("shirt", 0, {5, 6}), triangle("sword", 6, {}),
                  triangle("rock", 0, {})};
  return scene;
}

std::vector<std::string> names(const Scene& scene) {
  std::vector<std::string> result;
  for (const SceneMesh& mesh : scene.meshes) result.push_back(mesh.name);
  return result;
}

TEST(SelectParts, TakesTheSkeletonThatMovesMostAndListsAll) {
  Scene scene = horse_and_rider();
  select_parts(scene, {}, "", "file");
  EXPECT_EQ(names(scene), (std::vector<std::string>{"coat", "iron", "rock"}));
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("2 skeletons, 'spine' (6 vertices), 'hips' (3 vertices)"), std::string::npos)
      << scene.warnings[0];
  EXPECT_FALSE(scene.nodes[5].is_joint);
}

TEST(SelectParts, TheRootChoosesByBoneOrByWhatCarriesIt) {
  for (const char* root : {"hips", "rider"}) {
    Scene scene = horse_and_rider();
    select_parts(scene, {}, root, "file");
    EXPECT_EQ(names(scene), (std::vector<std::string>{"shirt", "sword", "rock"})) << root;
  }
  Scene scene = horse_and_rider();
  try {
    select_parts(scene, {}, "hands", "file");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(error.mend.find("'hips'"), std::string::npos) << error.mend;
  }
}

TEST(SelectParts, MeshesAreChosenByNameOrIndex) {
  Scene scene = horse_and_rider();
  select_parts(scene, {"shirt", "3"}, "", "file");
  EXPECT_EQ(names(scene), (std::vector<std::string>{"shirt", "sword"}));
  try {
    select_parts(scene, {"trousers"}, "", "file");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(error.mend.find("0 'shirt', 1 'sword'"), std::string::npos) << error.mend;
  }
}

TEST(BuildRig, AMeshThatIsNamedComesAlongThoughNothingCarriesIt) {
  Scene scene = horse_and_rider();
  scene.clips = {{"rest", 1, {}}};
  select_parts(scene, {"coat", "rock"}, "", "file");
  const Rig rig = build_rig(scene, "file");
  ASSERT_EQ(rig.skin.triangles.cols(), 2);
  ASSERT_FALSE(rig.warnings.empty());
  EXPECT_EQ(rig.warnings[0], "Mesh 'rock' hangs on nothing; its vertices go with the nearest bones.");
  // The coat was bound with its bone in the origin, and stands two metres up: the rock stays where it is.
  const Eigen::Matrix3Xd standing = skin_positions(rig.skeleton, rig.skin, bone_poses(rig, scene, scene.clips[0], 0));
  const Eigen::Vector3i rock = rig.skin.triangles.col(1);
  for (int c = 0; c < 3; ++c) {
    const Eigen::Vector3d at = Eigen::Vector3d::Unit(c) + Eigen::Vector3d::UnitY();
    EXPECT_LT((standing.col(rock[c]) - at).norm(), 1e-12) << c;
  }
}

TEST(AddCapsules, MakeAClosedSkinThatMovesWithTheBones) {
  Rig rig;
  for (int b = 0; b < 4; ++b) {
    rig.skeleton.names.push_back("bone" + std::to_string(b));
    rig.skeleton.parents.push_back(b - 1);
    rig.skeleton.bind_pose.push_back(Eigen::Affine3d(Eigen::Translation3d(0.1 * b, b, 0)));
    rig.skeleton.weighted.push_back(false);
  }
  add_capsules(rig, "file");
  EXPECT_EQ(rig.skeleton.weighted, (std::vector<bool>{true, true, true, false}));
  double volume = 0;
  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index t = 0; t < rig.skin.triangles.cols(); ++t) {
    const Eigen::Vector3i corner = rig.skin.triangles.col(t);
    for (int c = 0; c < 3; ++c) ++uses[{corner[c], corner[(c + 1) % 3]}];
    volume +=
        rig.skin.vertices.col(corner[0]).cross(rig.skin.vertices.col(corner[1])).dot(rig.skin.vertices.col(corner[2])) / 6;
  }
  for (const auto& [edge, count] : uses) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(uses.contains({edge.second, edge.first})) << "an open edge";
  }
  const double radius = 0.05 * 3, length = 3 * std::hypot(1, 0.1);
  const double whole = M_PI * radius * radius * length + 3 * 4.0 / 3 * M_PI * radius * radius * radius;
  EXPECT_NEAR(volume, whole, 0.12 * whole);  // a decagon's, and facing outward
}

/// A body that stands on a floor across one axis of the file and walks along another.
Scene walker(int up, double height) {
  Scene scene;
  scene.format = "bvh";
  scene.nodes = {node("hips", -1, false), node("foot", 0, false), node("head", 0, false)};
  scene.nodes[1].parts = {Eigen::Affine3d(Eigen::Translation3d(-height / 2 * Eigen::Vector3d::Unit(up)))};
  scene.nodes[2].parts = {Eigen::Affine3d(Eigen::Translation3d(height / 2 * Eigen::Vector3d::Unit(up)))};
  Channel channel;
  channel.node = 0;
  channel.translation = {Interpolation::kLinear, {0, 1}, Eigen::MatrixXd(3, 2), {}, {}};
  channel.translation.values.col(0) = height / 2 * Eigen::Vector3d::Unit(up);
  channel.translation.values.col(1) = height / 2 * Eigen::Vector3d::Unit(up) + 3 * height * Eigen::Vector3d::Unit(3 - up);
  scene.clips = {{"walk", 1, {channel}}};
  return scene;
}

TEST(SettleAxes, UpIsWhereTheFloorIsAndTheUnitMakesAPerson) {
  for (const int up : {1, 2}) {
    for (const auto& [height, unit_m] : {std::pair{1.2, 1.0}, {175.0, 0.01}, {27.0, 0.0254 / 0.45}, {46.4, 1.7 / 46.4}}) {
      Scene scene = walker(up, height);
      settle_axes(scene, "", 0);
      EXPECT_EQ(scene.up, std::string(1, "xyz"[up]));
      EXPECT_NEAR(scene.metres_per_unit, unit_m, 1e-12);
      EXPECT_EQ((scene.to_y_up * Eigen::Vector3d::Unit(up)).eval(), Eigen::Vector3d::UnitY().eval());
      EXPECT_EQ(scene.warnings.size(), 2u);  // both guesses are told
    }
  }
}

TEST(SettleAxes, WhatTheUserSaysIsTakenForAllAxes) {
  for (const std::string up : {"x", "y", "z", "-x", "-y", "-z"}) {
    Scene scene = walker(1, 1);
    settle_axes(scene, up, 0.5);
    const double sign = up.front() == '-' ? -1 : 1;
    EXPECT_EQ((scene.to_y_up * (sign * Eigen::Vector3d::Unit(up.back() - 'x'))).eval(), Eigen::Vector3d::UnitY().eval())
        << up;
    EXPECT_NEAR(scene.to_y_up.determinant(), 1, 1e-15);
    EXPECT_EQ(scene.metres_per_unit, 0.5);
    EXPECT_TRUE(scene.warnings.empty());
  }
}

}  // namespace
}  // namespace hydrostat::io::scene_selection_test

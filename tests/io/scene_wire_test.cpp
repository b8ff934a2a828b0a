#include "io/scene_wire.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace hydrostat::io::scene_wire_test {
namespace {

Scene small_scene() {
  Scene scene;
  scene.format = "gltf";
  SceneNode root, bone;
  root.name = "root";
  root.parts = {Eigen::Affine3d(Eigen::Translation3d(1, 2, 3))};
  bone = root;
  bone.name = "bone";
  bone.parent = 0;
  bone.is_joint = true;
  scene.nodes = {root, bone};
  SceneMesh mesh;
  mesh.name = "skin";
  mesh.vertices = Eigen::Matrix3d::Identity();
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  mesh.joints = {{1, Eigen::Affine3d::Identity(), {{0, 1.0}, {2, 0.5}}}};
  mesh.morphs = {{"smile", 0.25, Eigen::Vector2i(0, 2), Eigen::Matrix3Xd::Ones(3, 2)}, {"frown", 0, {}, {}}};
  scene.meshes = {mesh};
  Channel channel;
  channel.node = 1;
  channel.rotation = {Interpolation::kLinear, {0, 1}, Eigen::MatrixXd::Constant(4, 2, 0.5), {}, {}};
  scene.clips = {{"nod", 1.0, {channel}}};
  scene.clips[0].morphs = {{1, 0, {Interpolation::kLinear, {0, 1}, Eigen::MatrixXd::Constant(1, 2, 0.5), {}, {}}}};
  scene.warnings = {"none"};
  return scene;
}

TEST(SceneWire, WhatIsWrittenIsReadBack) {
  const std::string bytes = to_bytes(small_scene());
  const WorkerAnswer answer = from_bytes(bytes);
  ASSERT_TRUE(std::holds_alternative<Scene>(answer));
  EXPECT_EQ(std::get<Scene>(answer).nodes[1].name, "bone");
  EXPECT_EQ(std::get<Scene>(answer).meshes[0].joints[0].weights[1].weight, 0.5);
  EXPECT_EQ(std::get<Scene>(answer).meshes[0].morphs[0].name, "smile");
  EXPECT_EQ(std::get<Scene>(answer).clips[0].morphs[0].weight.values(0, 1), 0.5);
  EXPECT_EQ(to_bytes(answer), bytes);
}

TEST(SceneWire, AnErrorKeepsItsParts) {
  const WorkerAnswer answer = from_bytes(to_bytes(Error("a.fbx", "bone 'b'", "it is bent", "Straighten it")));
  ASSERT_TRUE(std::holds_alternative<Error>(answer));
  const Error& error = std::get<Error>(answer);
  EXPECT_EQ(error.file + error.where + error.what() + error.mend, "a.fbxbone 'b'it is bentStraighten it");
}

TEST(SceneWire, AnAnswerCutShortIsRefused) {
  const std::string bytes = to_bytes(small_scene());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW(from_bytes(std::string_view(bytes).substr(0, length)), std::runtime_error) << length;
  }
  EXPECT_THROW(from_bytes(bytes + '\0'), std::runtime_error);
}

TEST(SceneWire, AnySpoiledByteIsRefusedOrLeavesASoundScene) {
  const std::string bytes = to_bytes(small_scene());
  int refused = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    for (std::size_t at = 0; at < bytes.size(); ++at) {
      std::string spoiled = bytes;
      spoiled[at] = static_cast<char>(random());
      try {
        const WorkerAnswer answer = from_bytes(spoiled);
        // What was let through must be readable once more.
        EXPECT_NO_THROW(from_bytes(to_bytes(answer)));
      } catch (const std::runtime_error&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(SceneWire, IndicesThatPointNowhereAreRefused) {
  const auto refuses = [](auto&& spoil) {
    Scene scene = small_scene();
    spoil(scene);
    EXPECT_THROW(from_bytes(to_bytes(scene)), std::runtime_error);
  };
  refuses([](Scene& scene) { scene.nodes[0].parent = 1; });
  refuses([](Scene& scene) { scene.meshes[0].triangles(0) = 3; });
  refuses([](Scene& scene) { scene.meshes[0].joints[0].node = -1; });
  refuses([](Scene& scene) { scene.meshes[0].joints[0].weights[0].vertex = 7; });
  refuses([](Scene& scene) { scene.clips[0].channels[0].part = 1; });
  refuses([](Scene& scene) { scene.clips[0].channels[0].rotation.times = {1, 0}; });
  refuses([](Scene& scene) { scene.clips[0].channels[0].rotation.values.resize(3, 2); });
  refuses([](Scene& scene) { scene.meshes[0].morphs[0].vertices[1] = 3; });
  refuses([](Scene& scene) { scene.meshes[0].morphs[0].vertices[1] = 0; });
  refuses([](Scene& scene) { scene.meshes[0].morphs[0].offsets.resize(3, 1); });
  refuses([](Scene& scene) { scene.clips[0].morphs[0].node = 2; });
  refuses([](Scene& scene) { scene.clips[0].morphs[0].weight.times.clear(); });
  refuses([](Scene& scene) { scene.clips[0].morphs[0].weight.values.resize(2, 2); });
  refuses([](Scene& scene) { scene.meshes[0].vertices(0, 0) = std::numeric_limits<double>::quiet_NaN(); });
}

}  // namespace
}  // namespace hydrostat::io::scene_wire_test

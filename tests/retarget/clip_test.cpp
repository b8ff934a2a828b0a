#include "retarget/clip.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::retarget::clip_test {
namespace {

struct Rig {
  Skeleton skeleton;
  SkinnedMesh skin;
};

Rig random_rig(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Rig rig;
  rig.skeleton.names = {"a", "b", "c"};
  rig.skeleton.parents = {-1, 0, 1};
  rig.skeleton.weighted = {true, true, true};
  for (int b = 0; b < 3; ++b) {
    Eigen::Affine3d pose = Eigen::Affine3d::Identity();
    pose.linear() = physics::random_rotation(random) * (0.5 + uniform(random));
    pose.translation() = Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    rig.skeleton.bind_pose.push_back(pose);
  }
  rig.skin.vertices = physics::random_points(random, 20, 1);
  for (int v = 0; v < 20; ++v) {
    const double share = uniform(random);
    rig.skin.skin_weights.push_back({{v % 3, share}, {(v + 1) % 3, 1 - share}});
  }
  return rig;
}

TEST(SkinPositions, OfTheBindPoseAreTheVertices) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Rig rig = random_rig(seed);
    EXPECT_LT((skin_positions(rig.skeleton, rig.skin, rig.skeleton.bind_pose) - rig.skin.vertices).norm(), 1e-12);
  }
}

TEST(SkinPositions, FollowARigidMoveOfAllBones) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Rig rig = random_rig(seed);
    std::mt19937 random(seed);
    const Eigen::Affine3d move = Eigen::Translation3d(1, -2, 0.5) * Eigen::Affine3d(physics::random_rotation(random));
    std::vector<Eigen::Affine3d> pose;
    for (const Eigen::Affine3d& bind : rig.skeleton.bind_pose) pose.push_back(move * bind);
    EXPECT_LT((skin_positions(rig.skeleton, rig.skin, pose) - move * rig.skin.vertices).norm(), 1e-12);
  }
}

TEST(SkinPositions, MoveByTheWeightOfTheBoneThatMoves) {
  const Rig rig = random_rig(1);
  std::vector<Eigen::Affine3d> pose = rig.skeleton.bind_pose;
  const Eigen::Vector3d step(0.1, 0.2, -0.3);
  pose[1].pretranslate(step);
  const Eigen::Matrix3Xd moved = skin_positions(rig.skeleton, rig.skin, pose);
  for (std::size_t v = 0; v < 20; ++v) {
    double weight = 0;
    for (const auto& influence : rig.skin.skin_weights[v]) weight += influence.bone == 1 ? influence.weight : 0;
    const Eigen::Index column = static_cast<Eigen::Index>(v);
    EXPECT_LT((moved.col(column) - rig.skin.vertices.col(column) - weight * step).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::clip_test

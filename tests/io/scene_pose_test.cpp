#include "io/scene_pose.h"

#include <gtest/gtest.h>

#include <random>

namespace hydrostat::io::scene_pose_test {
namespace {

Eigen::Affine3d random_transform(std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  const auto draw = [&] { return number(random); };
  return Eigen::Translation3d(Eigen::Vector3d::NullaryExpr(draw)) *
         Eigen::Quaterniond(Eigen::Vector4d::NullaryExpr(draw)).normalized() *
         Eigen::Scaling(Eigen::Vector3d(Eigen::Vector3d::Constant(1) + 0.5 * Eigen::Vector3d::NullaryExpr(draw)));
}

/// Two nodes, one below the other, of random local transforms.
Scene random_pair(unsigned seed, ScaleInheritance inheritance) {
  std::mt19937 random(seed);
  Scene scene;
  SceneNode parent, child;
  parent.parts = {random_transform(random)};
  child.parts = {random_transform(random)};
  child.parent = 0;
  child.inheritance = inheritance;
  scene.nodes = {parent, child};
  return scene;
}

TEST(NodePoses, OrdinaryInheritanceIsTheProductOfTheMatrices) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scene scene = random_pair(seed, ScaleInheritance::kOrdinary);
    const Eigen::Affine3d product = scene.nodes[0].parts[0] * scene.nodes[1].parts[0];
    EXPECT_LT((node_poses(scene, nullptr, 0)[1].matrix() - product.matrix()).norm(), 1e-12);
  }
}

TEST(NodePoses, ACompensatedChildKeepsItsShapeUnderAScaledParent) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scene scene = random_pair(seed, ScaleInheritance::kCompensated);
    const Eigen::Affine3d pose = node_poses(scene, nullptr, 0)[1];
    const Eigen::Matrix3d local = scene.nodes[1].parts[0].linear();
    EXPECT_LT((pose.linear().transpose() * pose.linear() - local.transpose() * local).norm(), 1e-12);
    EXPECT_LT((pose.translation() - scene.nodes[0].parts[0] * scene.nodes[1].parts[0].translation()).norm(), 1e-12);
  }
}

TEST(NodePoses, ScaleAfterRotationLeavesNoShear) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Eigen::Matrix3d linear = node_poses(random_pair(seed, ScaleInheritance::kAfterRotation), nullptr, 0)[1].linear();
    const Eigen::Matrix3d products = linear.transpose() * linear;
    EXPECT_LT((products - Eigen::Matrix3d(products.diagonal().asDiagonal())).norm(), 1e-12);
  }
}

TEST(NodePoses, KeysOfEveryPropertyMakeTranslateRotateScale) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Scene scene = random_pair(seed, ScaleInheritance::kOrdinary);
    const Eigen::Affine3d wanted = random_transform(random);
    const Turn turn = split_turn(wanted.linear());
    Channel channel;
    channel.node = 1;
    channel.translation = {Interpolation::kLinear, {0}, wanted.translation(), {}, {}};
    channel.rotation = {Interpolation::kLinear, {0}, Eigen::Quaterniond(turn.rotation).coeffs(), {}, {}};
    channel.scale = {Interpolation::kLinear, {0}, turn.stretch.diagonal(), {}, {}};
    const SceneClip clip{"clip", 1, {channel}};
    EXPECT_LT((node_poses(scene, &clip, 0.5)[1].matrix() - (scene.nodes[0].parts[0] * wanted).matrix()).norm(), 1e-12);
  }
}

TEST(SplitTurn, TheRotationIsProperAndTheProductIsBack) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Eigen::Matrix3d linear = random_transform(random).linear();
    if (seed % 2 == 1) linear.col(0) *= -1;
    const Turn turn = split_turn(linear);
    EXPECT_NEAR(turn.rotation.determinant(), 1, 1e-12);
    EXPECT_LT((turn.rotation * turn.stretch - linear).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace hydrostat::io::scene_pose_test

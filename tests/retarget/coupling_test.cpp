#include "retarget/coupling.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "retarget/error.h"
#include "shapes.h"

namespace hydrostat::retarget {
namespace {

struct Setting {
  ControlMesh mesh;
  Embedding skin_embedding;
};

Setting body_of(const Character& character) {
  Setting setting;
  setting.mesh = build_control_mesh(character.skeleton, character.skin, {.least_fill = 0});
  setting.skin_embedding = embed_skin(setting.mesh, character.skin);
  return setting;
}

Clip clip_of(std::vector<std::vector<Eigen::Affine3d>> poses) {
  Clip clip;
  clip.name = "test";
  clip.rate_hz = 30;
  clip.bone_pose = std::move(poses);
  return clip;
}

/// Every bone moved by the same map.
std::vector<Eigen::Affine3d> moved_bones(const Skeleton& skeleton, const Eigen::Affine3d& map) {
  std::vector<Eigen::Affine3d> pose;
  for (const Eigen::Affine3d& bind : skeleton.bind_pose) pose.push_back(map * bind);
  return pose;
}

/// The worm bent into a bow: each bone turned by `bend` [rad] against the one before.
std::vector<Eigen::Affine3d> bent_bones(const Skeleton& skeleton, double bend) {
  std::vector<Eigen::Affine3d> pose(skeleton.bind_pose);
  for (std::size_t b = 1; b < pose.size(); ++b)
    pose[b] = pose[b - 1] * Eigen::AngleAxisd(bend, Eigen::Vector3d::UnitX()) *
              (skeleton.bind_pose[b - 1].inverse() * skeleton.bind_pose[b]);
  return pose;
}

TEST(Coupling, MovesTheMeshRigidlyWithItsBones) {
  Character character = worm();
  const Setting body = body_of(character);
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::srand(seed);
    Eigen::Affine3d map = Eigen::Translation3d(Eigen::Vector3d::Random()) * Eigen::Quaterniond::UnitRandom();
    character.clip = clip_of({moved_bones(character.skeleton, map)});
    const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding);
    EXPECT_LT((coupled.motion.at(0) - map * body.mesh.nodes).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT(coupled.error_max_length, 1e-9);
    EXPECT_EQ(coupled.unconverged_frames, 0);
  }
}

TEST(Coupling, KeepsSquashAndStretch) {
  Character character = worm();
  const Setting body = body_of(character);
  Eigen::Affine3d squash = Eigen::Affine3d::Identity();
  squash.linear().diagonal() << 1.3, 0.6, 1.2;
  character.clip = clip_of({moved_bones(character.skeleton, squash)});
  const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding);
  EXPECT_LT((coupled.motion.at(0) - squash * body.mesh.nodes).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Coupling, FollowsABendingWorm) {
  Character character = worm();
  const Setting body = body_of(character);
  character.clip =
      clip_of({bent_bones(character.skeleton, 0), bent_bones(character.skeleton, 0.1), bent_bones(character.skeleton, 0.2)});
  const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding);
  EXPECT_EQ(coupled.motion.count(), 3);
  EXPECT_DOUBLE_EQ(coupled.motion.rate_hz, 30);
  EXPECT_FALSE(coupled.motion.loop);
  EXPECT_EQ(coupled.unconverged_frames, 0);
  EXPECT_EQ(coupled.worst_frame, 2);
  EXPECT_GT(coupled.error_max_length, 1e-4);
  EXPECT_LT(coupled.error_rms_length, 0.005);  // [L]
  EXPECT_LT(coupled.error_max_length, 0.02);
}

TEST(Coupling, ReportsTheDistanceToTheSkinnedClip) {
  Character character = worm();
  const Setting body = body_of(character);
  character.clip = clip_of({bent_bones(character.skeleton, 0.15)});
  const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding);
  const Eigen::Matrix3Xd skinned = skin_positions(character.skeleton, character.skin, character.clip.bone_pose[0]);
  const Eigen::VectorXd distance =
      (embedded_positions(body.skin_embedding, coupled.motion.at(0)) - skinned).colwise().norm();
  EXPECT_NEAR(coupled.error_max_length, distance.maxCoeff() / 0.6, 1e-12);
  EXPECT_NEAR(coupled.error_rms_length, distance.norm() / std::sqrt(static_cast<double>(distance.size())) / 0.6, 1e-12);
}

TEST(Coupling, IsTheSameForAnyNumberOfThreads) {
  Character character = worm();
  const Setting body = body_of(character);
  std::vector<std::vector<Eigen::Affine3d>> poses;
  for (int f = 0; f < 7; ++f) poses.push_back(bent_bones(character.skeleton, 0.04 * f));
  character.clip = clip_of(poses);
  const CoupledMotion alone = couple(character, body.mesh, body.skin_embedding, {.threads = 1});
  for (const int threads : {2, 3, 16}) {
    const CoupledMotion together = couple(character, body.mesh, body.skin_embedding, {.threads = threads});
    EXPECT_EQ(alone.motion.frames, together.motion.frames);
    EXPECT_EQ(alone.error_rms_length, together.error_rms_length);
  }
}

TEST(Coupling, LegsMoveApart) {
  Character character = two_legged(0.05);
  const Setting body = body_of(character);
  std::vector<Eigen::Affine3d> pose = character.skeleton.bind_pose;
  pose[1] = Eigen::Translation3d(0, 0, 0.1) * pose[1];
  pose[2] = Eigen::Translation3d(0, 0, 0.1) * pose[2];
  character.clip = clip_of({pose});
  const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding);
  const Eigen::Matrix3Xd moved = embedded_positions(body.skin_embedding, coupled.motion.at(0)) - character.skin.vertices;
  for (Eigen::Index v = 0; v < moved.cols(); ++v) {
    if (character.skin.vertices(1, v) > 0.3) continue;
    EXPECT_NEAR(moved(2, v), character.skin.vertices(0, v) > 0 ? 0.1 : 0, 0.005);
  }
}

TEST(Coupling, RefusesAClipWithoutFrames) {
  const Character character = worm();
  const Setting body = body_of(character);
  EXPECT_THROW(couple(character, body.mesh, body.skin_embedding), Error);
}

TEST(CouplingOptions, NameTheRuleTheyBreak) {
  EXPECT_EQ(broken_rule(CouplingOptions{}), "");
  EXPECT_NE(broken_rule(CouplingOptions{.anchor_distance = 0}), "");
  EXPECT_NE(broken_rule(CouplingOptions{.elasticity = -1}), "");
  EXPECT_NE(broken_rule(CouplingOptions{.least_weight = 1}), "");
  EXPECT_NE(broken_rule(CouplingOptions{.threads = 0}), "");
}

}  // namespace
}  // namespace hydrostat::retarget

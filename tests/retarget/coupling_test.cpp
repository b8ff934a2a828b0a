#include "retarget/coupling.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "retarget/error.h"
#include "retarget/morphs.h"
#include "shapes.h"

namespace hydrostat::retarget::coupling_test {
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
    for (const bool symmetric : {false, true}) {
      const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding, {.symmetric = symmetric});
      EXPECT_LT((coupled.motion.at(0) - map * body.mesh.nodes).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_LT(coupled.error_max_length, 1e-9);
      EXPECT_EQ(coupled.unconverged_frames, 0);
    }
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

/// The mirror image of each node across x = 0, by its number.
std::vector<Eigen::Index> mirrored_nodes(const Eigen::Matrix3Xd& nodes) {
  std::vector<Eigen::Index> images;
  for (const auto node : nodes.colwise()) {
    Eigen::Index image = 0;
    const double miss = (nodes.colwise() - Eigen::Vector3d(-node.x(), node.y(), node.z())).colwise().norm().minCoeff(&image);
    EXPECT_LT(miss, 1e-9);
    images.push_back(image);
  }
  return images;
}

TEST(Coupling, OfSymmetricAnchorsKeepsAMirrorImageOfItselfOne) {
  Character character = worm();
  Setting body;
  body.mesh = build_control_mesh(character.skeleton, character.skin, {.lattice = {2, 2, 16}, .least_fill = 0});
  body.skin_embedding = embed_skin(body.mesh, character.skin);
  const std::vector<Eigen::Index> images = mirrored_nodes(body.mesh.nodes);
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    character.clip = clip_of({bent_bones(character.skeleton, std::uniform_real_distribution<double>(-0.4, 0.4)(random))});
    const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding, {.symmetric = true});
    Eigen::Matrix3Xd mirrored = coupled.motion.at(0)(Eigen::all, images);
    mirrored.row(0) *= -1;
    EXPECT_LT((mirrored - coupled.motion.at(0)).cwiseAbs().maxCoeff(), 5e-6);  // [m]; the solver's tolerance
  }
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

/// The worm with one morph target of its middle third, which swells or goes aside by `size` [m]; no weight in the first frame,
/// all in the second.
Character morphing_worm(double size, bool swells) {
  Character character = worm();
  character.clip = clip_of({character.skeleton.bind_pose, character.skeleton.bind_pose});
  const auto& vertices = character.skin.vertices;
  const Eigen::Vector3d middle = 0.5 * (vertices.rowwise().minCoeff() + vertices.rowwise().maxCoeff());
  std::vector<int> moved;
  for (int v = 0; v < vertices.cols(); ++v) {
    if (std::abs(vertices(2, v) - middle.z()) < 0.1) moved.push_back(v);
  }
  MorphTarget swell{"swell", Eigen::Map<const Eigen::VectorXi>(moved.data(), static_cast<Eigen::Index>(moved.size())), {}};
  swell.offsets = vertices(Eigen::all, moved).colwise() - middle;
  for (auto offset : swell.offsets.colwise()) {
    const double window = std::pow(std::cos(M_PI / 2 * offset.z() / 0.1), 2);
    offset.z() = 0;
    offset = size * window * (swells ? Eigen::Vector3d(offset.normalized()) : Eigen::Vector3d(Eigen::Vector3d::UnitX()));
  }
  character.skin.morphs = {swell};
  character.clip.morph_weights = Eigen::RowVector2d(0, 1);
  return character;
}

TEST(Coupling, LargeMorphTargetsMoveTheBodyOthersAreLeftToBeWornAndNothingIsLost) {
  Character character = morphing_worm(0.03, false);
  const Setting body = body_of(character);
  const CoupledMotion coupled = couple(character, body.mesh, body.skin_embedding);
  ASSERT_EQ(coupled.node_morphs.size(), 1u);
  EXPECT_LT((coupled.motion.at(0) - body.mesh.nodes).cwiseAbs().maxCoeff(), 1e-9);
  const Eigen::Matrix3Xd whole = skin_positions(character, 1);
  const Eigen::Matrix3Xd of_body = embedded_positions(body.skin_embedding, coupled.motion.at(1));
  EXPECT_GT((of_body - character.skin.vertices).norm(), 0.5 * (whole - character.skin.vertices).norm());
  const std::vector<MorphTarget> left = left_by_nodes(character.skin.morphs, coupled.node_morphs, body.skin_embedding);
  const Eigen::Matrix3Xd both = morphed(of_body, left, Eigen::VectorXd::Ones(1));
  // The embedding misses the skin by as much in the bind pose.
  const Eigen::Matrix3Xd miss = embedded_positions(body.skin_embedding, body.mesh.nodes) - character.skin.vertices;
  EXPECT_LT((both - miss - whole).cwiseAbs().maxCoeff(), 1e-4);

  EXPECT_TRUE(coupled.left_large_morphs.empty());

  for (const bool swells : {false, true}) {
    SCOPED_TRACE(swells ? "large, and changes the volume" : "small");
    character = morphing_worm(swells ? 0.03 : 0.004, swells);
    const CoupledMotion worn = couple(character, body.mesh, body.skin_embedding);
    EXPECT_TRUE(worn.node_morphs.empty());
    EXPECT_EQ(worn.left_large_morphs.size(), swells ? 1u : 0u);
    EXPECT_EQ(worn.motion.at(1), worn.motion.at(0));
    EXPECT_LT(worn.error_max_length, 0.004) << "what is worn over the body is no error of it";
    EXPECT_EQ(left_by_nodes(character.skin.morphs, worn.node_morphs, body.skin_embedding)[0].offsets,
              character.skin.morphs[0].offsets);
  }
}

TEST(MovingMorphs, ALoopKeepsItsPhaseAndClosesAndAOneShotHoldsItsLast) {
  Motion motion;
  motion.loop = true;
  motion.frames.setZero(3, 10);
  const Eigen::MatrixXd told = Eigen::RowVectorXd::LinSpaced(11, 0, 1);
  MovingMorphs morphs{{}, closed_weights(told, motion), 10, true};
  ASSERT_EQ(morphs.weights.cols(), 10);
  EXPECT_NEAR(morphs.at(0)[0], 0.5, 1e-12) << "half of what its end misses its start by";
  EXPECT_NEAR(morphs.at(0.5)[0], told(0, 5), 1e-12);
  for (const double t : {0.0, 0.13, 0.5, 0.97}) {
    for (const int cycle : {1, 7}) EXPECT_NEAR(morphs.at(t + cycle)[0], morphs.at(t)[0], 1e-9);
  }
  EXPECT_NEAR(morphs.at(1 - 1e-9)[0], morphs.at(0)[0], 1e-6);
  motion.loop = false;
  morphs = {{}, closed_weights(told, motion), 10, false};
  EXPECT_EQ(morphs.weights, told);
  EXPECT_NEAR(morphs.at(0.55)[0], 0.55, 1e-12);
  EXPECT_EQ(morphs.at(7)[0], 1);
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
}  // namespace hydrostat::retarget::coupling_test

#include "retarget/level.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "tests/retarget/shapes.h"

namespace hydrostat::retarget {
namespace {

constexpr double kLimit = 0.3;

Eigen::Matrix3d drawn_tensor(std::mt19937& random) {
  Eigen::Matrix3d tensor;
  for (double& value : tensor.reshaped()) value = static_cast<double>(random()) / 4294967295.0 - 0.5;
  return tensor + tensor.transpose();
}

/// A block on one bone that floats without weight, as a creature that has no clip: its target is the rest shape under
/// `deform`.
struct Floating {
  Performer performer;
  SignalSet signals;
  Rig rig;
};

CreatureOptions options_for(int nodes, bool hexahedra) {
  CreatureOptions options;
  options.nodes = nodes;
  options.hexahedra = hexahedra;
  if (hexahedra) options.material = BodyMaterial::kStableNeoHookean;
  return options;
}

Floating floating_block(int nodes, const Eigen::Matrix3d& deform, bool hexahedra = false) {
  Floating made;
  made.rig.skeleton = one_bone();
  made.rig.skin = box_skin({0, 0, 0}, {1, 0.4, 0.5}, 0, 8);
  const Creature creature = make_creature({made.rig.skeleton, made.rig.skin, {}}, options_for(nodes, hexahedra));
  made.rig.bone_weights = creature.mesh.bone_weights;
  Performer& performer = made.performer;
  performer.skin = made.rig.skin;
  performer.embedding = creature.skin;
  performer.mesh = creature.mesh;
  performer.contacts = creature.contacts;
  performer.scene = creature.scene;
  performer.scene.gravity.setZero();
  performer.muscles = make_muscles(creature.scene.body, made.rig.skeleton, creature.mesh.bone_weights);
  constexpr Eigen::Index kFrames = 4;
  Motion& target = performer.prepared.target;
  target.loop = true;
  target.frames = (deform * creature.mesh.nodes).reshaped().replicate(1, kFrames);
  performer.prepared.contacts.touching.setConstant(creature.contacts.vertices.size(), kFrames, false);
  performer.prepared.contacts.sliding_x.resize(0, kFrames);
  performer.prepared.contacts.sliding_z.resize(0, kFrames);
  performer.clip_skin = target;
  performer.clip_skin.frames = (deform * made.rig.skin.vertices).reshaped().replicate(1, kFrames);
  performer.clip_points = point_motion(performer.scene.contact_points, target);
  performer.length = creature.length;
  performer.size = creature.size;
  const physics::Body& body = creature.scene.body;
  Eigen::RowVectorXd stretch(body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e)
    stretch[e] = (deform * (body.rest.col(body.edges(1, e)) - body.rest.col(body.edges(0, e)))).norm() / body.rest_length[e];
  const Eigen::MatrixXd activation = stretch.replicate(kFrames, 1);
  made.signals = analyse_signals({signal::Kind::loop, target.duration_s(), kLimit, activation, 0 * activation,
                                  performer.muscles.edge_bone, body.edges, body.rest_length, body.edge_stiffness},
                                 {});
  return made;
}

TEST(TensorsAlong, FindTheFieldThatIsTheSameEverywhere) {
  const Creature creature = make_creature({one_bone(), box_skin({0, 0, 0}, {1, 0.4, 0.5}, 0, 8), {}}, {});
  const ControlMesh& mesh = creature.mesh;
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    const Eigen::Matrix3d tensor = drawn_tensor(random);
    Eigen::VectorXd values(mesh.edges.cols());
    for (Eigen::Index e = 0; e < values.size(); ++e) {
      const Eigen::Vector3d n = (mesh.nodes.col(mesh.edges(1, e)) - mesh.nodes.col(mesh.edges(0, e))).normalized();
      values[e] = n.dot(tensor * n);
    }
    const Eigen::MatrixXd found = tensors_along(mesh.nodes, mesh.edges, values);
    for (Eigen::Index i = 0; i < mesh.nodes.cols(); ++i) {
      const auto six = found.col(0).segment<6>(6 * i);
      Eigen::Matrix3d at;
      at << six[0], six[3], six[5], six[3], six[1], six[4], six[5], six[4], six[2];
      EXPECT_LT((at - tensor).norm(), 1e-9) << "seed " << seed << ", node " << i;
    }
  }
}

// A stretch with shear that keeps the volume, on coarser and finer meshes: what has no stress on one has none on the others.
TEST(AtLevel, CarriesAUniformStrainExactly) {
  Eigen::Matrix3d deform;
  deform << 1.15, 0.05, 0, 0, 1 / std::sqrt(1.15), 0.08, 0, 0, 1 / std::sqrt(1.15);
  const std::array<std::pair<int, bool>, 3> cases{{{40, false}, {200, false}, {40, true}}};
  for (const auto& [nodes, hexahedra] : cases) {
    const Floating solved = floating_block(90, deform, hexahedra);
    const Level level = at_level(solved.performer, solved.signals, solved.rig, options_for(nodes, hexahedra));
    const physics::Body& body = level.performer.scene.body;
    ASSERT_NE(body.node_count(), solved.performer.mesh.node_count());
    const Eigen::Matrix3Xd wanted = deform * body.rest;
    EXPECT_LT((level.performer.prepared.target.at(0) - wanted).cwiseAbs().maxCoeff(), 1e-6) << nodes;
    const Eigen::MatrixXd played = signal::synthesise_samples(level.signals.activation, level.signals.samples());
    double worst = 0;
    for (int e = 0; e < body.edge_count(); ++e) {
      const double stretch = (wanted.col(body.edges(1, e)) - wanted.col(body.edges(0, e))).norm() / body.rest_length[e];
      worst = std::max(worst, std::abs(played(0, e) - stretch));
    }
    // Of elements the stress-free shape is the one that fits its constraints best: nearly, not to the digit, this one.
    EXPECT_LT(worst, hexahedra ? 0.03 : 1e-5) << nodes;
    EXPECT_EQ(level.signals.samples(), solved.signals.samples());
    EXPECT_EQ(level.performer.muscles.names, solved.performer.muscles.names);
  }
}

TEST(LevelCosts, FallWithTheNodesAndAreTheSameEachTime) {
  const Floating solved = floating_block(60, Eigen::Matrix3d::Identity());
  ReplayOptions replay;
  const std::vector<LevelCost> costs = level_costs(solved.performer, solved.rig, {}, replay);
  ASSERT_GE(costs.size(), 3u);
  EXPECT_GE(costs.front().nodes, 3 * solved.performer.mesh.node_count());
  for (std::size_t k = 1; k < costs.size(); ++k) {
    EXPECT_LT(costs[k].nodes, costs[k - 1].nodes);
    EXPECT_LT(costs[k].work_ms, costs[k - 1].work_ms);
  }
  const Performer& performer = solved.performer;
  const double work_ms = frame_work_ms(performer.scene, performer.muscles.fields.cols(), replay);
  EXPECT_EQ(frame_work_ms(performer.scene, performer.muscles.fields.cols(), replay), work_ms);
  replay.correct = false;
  EXPECT_LT(frame_work_ms(performer.scene, performer.muscles.fields.cols(), replay), work_ms);
}

}  // namespace
}  // namespace hydrostat::retarget

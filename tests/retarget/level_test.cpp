#include "retarget/level.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "retarget/corrector.h"
#include "retarget/cpu_seconds.h"
#include "retarget/inverse_dynamics.h"
#include "retarget/level_cost.h"
#include "retarget/level_target.h"
#include "retarget/rest_lengths.h"
#include "retarget/sag.h"
#include "retarget/step_cost.h"
#include "retarget/tensor_field.h"
#include "tests/retarget/shapes.h"
#include "tests/sanitizers.h"

namespace hydrostat::retarget::level_test {
namespace {

constexpr double kLimit = 0.3;

Eigen::Matrix3d drawn_tensor(std::mt19937& random) {
  Eigen::Matrix3d tensor;
  for (double& value : tensor.reshaped()) value = static_cast<double>(random()) / 4294967295.0 - 0.5;
  return tensor + tensor.transpose();
}

/// A block on one bone, as a creature that has no clip, and its target is the rest shape.
struct Solved {
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

/// Activations with which the body is without stress where it is deformed alike everywhere: springs are as long as they want
/// to be, and elements read logarithms.
Eigen::RowVectorXd stress_free(const physics::Body& body, const Eigen::Matrix3d& deform) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> squared(deform.transpose() * deform);
  Eigen::RowVectorXd activation(body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e) {
    const Eigen::Vector3d n = (body.rest.col(body.edges(1, e)) - body.rest.col(body.edges(0, e))).normalized();
    const Eigen::Vector3d along = (squared.eigenvectors().transpose() * n).cwiseAbs2();
    activation[e] = body.elements.empty() ? (deform * n).norm()
                                          : std::exp(0.5 * along.dot(squared.eigenvalues().array().log().matrix()));
  }
  return activation;
}

/// The same activations in every frame.
void set_signals(const Eigen::RowVectorXd& activation, Solved& made) {
  const physics::Body& body = made.performer.scene.body;
  const Motion& target = made.performer.prepared.target;
  const Eigen::MatrixXd all = activation.replicate(target.count(), 1);
  made.signals = analyse_signals({signal::Kind::loop, target.duration_s(), kLimit, all, 0 * all,
                                  made.performer.muscles.edge_bone, body.edges, body.rest_length, body.edge_stiffness},
                                 {});
}

/// Floats without weight, deformed alike everywhere and without stress.
Solved floating_block(int nodes, const Eigen::Matrix3d& deform, bool hexahedra = false) {
  Solved made;
  made.rig.skeleton = one_bone();
  made.rig.skin = box_skin({0, 0, 0}, {1, 0.4, 0.5});
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
  set_signals(stress_free(creature.scene.body, deform), made);
  return made;
}

/// The same block under its weight, solved: its sole stands in every frame.
Solved standing_block(int nodes) {
  Solved made = floating_block(nodes, Eigen::Matrix3d::Identity());
  Performer& performer = made.performer;
  const Eigen::Index frames = performer.prepared.target.count();
  performer.scene.gravity = physics::Scene().gravity;
  ContactSchedule& contacts = performer.prepared.contacts;
  Patch sole{made.rig.skeleton.names[0], {}};
  for (int p = 0; p < performer.contacts.vertices.size(); ++p) {
    contacts.touching.row(p).setConstant(performer.clip_points.at(0)(1, p) < 1e-6);
    sole.points.push_back(p);
  }
  contacts.patches = {sole};
  contacts.state = {std::vector<ContactState>(static_cast<std::size_t>(frames), ContactState::kStick)};
  contacts.sliding_x = contacts.sliding_z = Eigen::MatrixXd::Zero(1, frames);
  InverseOptions inverse;
  inverse.limit = kLimit;
  const InverseDynamics found = solve_inverse_dynamics(performer.prepared, performer.scene, performer.length, inverse);
  set_signals(found.activation.col(0).transpose(), made);
  return made;
}

/// How far [m] the nodes are from where they start, RMS, after 0.15 s under constant activations.
double moved(const physics::Scene& scene, const Eigen::Matrix3Xd& start, const Eigen::VectorXd& activation) {
  constexpr double kStep = 1.0 / 480;
  physics::State state{start, Eigen::Matrix3Xd::Zero(3, scene.body.node_count()), {}};
  const auto stepper = physics::make_explicit_stepper(scene);
  physics::Impulses impulses = physics::make_impulses(scene);
  for (int k = 0; k < few_steps(72); ++k) stepper->step(kStep, activation, nullptr, state, impulses);
  return std::sqrt((state.x - start).colwise().squaredNorm().mean());
}

TEST(TensorField, ThatIsTheSameEverywhereIsFoundAndGoesToAnotherMesh) {
  const Character block{one_bone(), box_skin({0, 0, 0}, {1, 0.4, 0.5}), {}};
  const ControlMesh mesh = make_creature(block, options_for(90, false)).mesh;
  const ControlMesh other = make_creature(block, options_for(40, false)).mesh;
  ASSERT_NE(other.node_count(), mesh.node_count());
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    const Eigen::Matrix3d tensor = drawn_tensor(random);
    const auto along = [&](const ControlMesh& of) {
      Eigen::VectorXd values(of.edges.cols());
      for (Eigen::Index e = 0; e < values.size(); ++e) {
        const Eigen::Vector3d n = (of.nodes.col(of.edges(1, e)) - of.nodes.col(of.edges(0, e))).normalized();
        values[e] = n.dot(tensor * n);
      }
      return values;
    };
    const Eigen::MatrixXd found = tensors_along(mesh.nodes, mesh.edges, along(mesh));
    Eigen::Vector<double, 6> six;
    six << tensor(0, 0), tensor(1, 1), tensor(2, 2), tensor(0, 1), tensor(1, 2), tensor(0, 2);
    EXPECT_LT((found - six.replicate(mesh.node_count(), 1)).cwiseAbs().maxCoeff(), 1e-9) << "seed " << seed;
    const Eigen::MatrixXd carried = values_along(found, mesh, mesh.bone_weights, other, other.edges);
    EXPECT_LT((carried - along(other)).cwiseAbs().maxCoeff(), 1e-9) << "seed " << seed;
  }
}

// A stretch with shear that keeps the volume, on coarser and finer meshes: what has no stress on one has none on the others.
TEST(AtLevel, CarriesAUniformStrainExactly) {
  Eigen::Matrix3d deform;
  deform << 1.15, 0.05, 0, 0, 1 / std::sqrt(1.15), 0.08, 0, 0, 1 / std::sqrt(1.15);
  const std::array<std::pair<int, bool>, 2> cases{{{200, false}, {40, true}}};
  for (const auto& [nodes, hexahedra] : cases) {
    if (kSanitized && !hexahedra) continue;
    const Solved solved = floating_block(90, deform, hexahedra);
    const Level level = at_level(solved.performer, solved.signals, solved.rig, options_for(nodes, hexahedra));
    const physics::Body& body = level.performer.scene.body;
    ASSERT_NE(body.node_count(), solved.performer.mesh.node_count());
    const Eigen::Matrix3Xd wanted = deform * body.rest;
    EXPECT_LT((level.performer.prepared.target.at(0) - wanted).cwiseAbs().maxCoeff(), 1e-6) << nodes;
    const Eigen::MatrixXd played = signal::synthesise_samples(level.signals.activation, level.signals.samples());
    ASSERT_EQ(played.cols(), body.edge_count());
    const Eigen::RowVectorXd exact = stress_free(body, deform);
    // Elements have more activations than strains: what counts is that they stay as they are.
    const double most = (played.row(0) - exact).cwiseAbs().maxCoeff();
    EXPECT_LT(most, hexahedra ? 0.05 : 1e-5) << nodes;
    const physics::Scene& scene = level.performer.scene;
    EXPECT_LT(moved(scene, wanted, played.row(0)), 0.03 * moved(scene, wanted, Eigen::VectorXd::Ones(played.cols()))) << nodes;
    EXPECT_EQ(level.signals.samples(), solved.signals.samples());
    EXPECT_EQ(level.performer.muscles.names, solved.performer.muscles.names);
  }
}

// What bears the weight on one mesh bears it on coarser and finer ones, which passive bodies sag under.
TEST(AtLevel, StandsWhereTheSolvedCreatureDoes) {
  const Solved solved = standing_block(90);
  for (const int nodes : {40, 200}) {
    if (kSanitized && nodes > 40) continue;
    const Level level = at_level(solved.performer, solved.signals, solved.rig, options_for(nodes, false));
    const physics::Scene& scene = level.performer.scene;
    EXPECT_TRUE(level.performer.prepared.contacts.touching.col(0).any());
    EXPECT_LT((level.performer.prepared.target.at(0) - scene.body.rest).cwiseAbs().maxCoeff(), 2e-3) << nodes;
    const Eigen::VectorXd played = signal::synthesise_samples(level.signals.activation, level.signals.samples()).row(0);
    const Eigen::Matrix3Xd& rest = scene.body.rest;
    EXPECT_LT(moved(scene, rest, played), 0.2 * moved(scene, rest, Eigen::VectorXd::Ones(played.size()))) << nodes;
  }
}

// A shape that has too much volume is held against the tets, which want theirs, as firmly as the solved one was.
TEST(AtLevel, HoldsOnToTheSolvedShapeByItsFirmness) {
  Solved solved = standing_block(90);
  PreparedTarget& prepared = solved.performer.prepared;
  const Eigen::Vector3d stretch(1, 1.1, 1);
  for (Eigen::Index f = 0; f < prepared.target.count(); ++f) prepared.target.at(f) = stretch.asDiagonal() * prepared.target.at(f).eval();
  for (const int nodes : {40, 120}) {
    if (kSanitized && nodes > 40) continue;
    const Creature level = make_creature({solved.rig.skeleton, solved.rig.skin, {}}, options_for(nodes, false));
    const auto missed = [&](double firmness) {  // [m] of the stretched height, in the mean
      prepared.firmness = firmness;
      const PreparedTarget carried = carried_target(solved.performer, solved.rig, level);
      EXPECT_EQ(carried.firmness, firmness);
      return (stretch.asDiagonal() * level.mesh.nodes - carried.target.at(0)).row(1).mean();
    };
    const double loose = missed(1), firm = missed(30);
    EXPECT_GT(loose, 0.01) << nodes;
    EXPECT_LT(firm, 0.9 * loose) << nodes;  // measured: 0.84, 0.67
  }
}

// Each mesh has legs of its own: what the solved body needs to carry its weight is not what its level does.
TEST(AtLevel, IsAsStiffAsItsOwnWeightAsks) {
  const Solved solved = standing_block(90);
  for (const double softness : {0.005, 2.0}) {
    CreatureOptions options = options_for(40, false);
    options.softness = softness;
    const Level level = at_level(solved.performer, solved.signals, solved.rig, options);
    const PreparedTarget& prepared = level.performer.prepared;
    EXPECT_EQ(prepared.stiffness > 1, softness > 1) << softness;
    EXPECT_LE(sag(level.performer.scene, prepared, level.performer.length), kMostSag + 1e-9) << softness;
  }
}

/// What the level plays in its first frame.
Eigen::VectorXd played(const Level& level) {
  return signal::synthesise_samples(level.signals.activation, level.signals.samples()).row(0);
}

// Edits of the coefficients themselves: what they add to the squares of the activations is the same tensor everywhere.
TEST(AtLevel, FeelsWhatWasDoneToTheSolvedSignals) {
  Solved solved = standing_block(40);
  const physics::Body& body = solved.performer.scene.body;
  const Eigen::RowVectorXd before = signal::synthesise_samples(solved.signals.activation, solved.signals.samples()).row(0);
  const Level plain = at_level(solved.performer, solved.signals, solved.rig, options_for(90, false));
  const physics::Body& of_level = plain.performer.scene.body;
  for (unsigned seed = 0; seed < 3; ++seed) {
    std::mt19937 random(seed);
    const Eigen::Matrix3d tensor = 0.05 * drawn_tensor(random);
    const auto along = [&tensor](const physics::Body& of, int e) {
      const Eigen::Vector3d n = (of.rest.col(of.edges(1, e)) - of.rest.col(of.edges(0, e))).normalized();
      return n.dot(tensor * n);
    };
    Eigen::RowVectorXd edited = before;
    for (int e = 0; e < body.edge_count(); ++e) edited[e] = std::sqrt(before[e] * before[e] + along(body, e));
    set_signals(edited, solved);
    const Eigen::VectorXd after = played(at_level(solved.performer, solved.signals, solved.rig, options_for(90, false)));
    const Eigen::VectorXd change = after.cwiseAbs2() - played(plain).cwiseAbs2();
    for (int e = 0; e < of_level.edge_count(); ++e) EXPECT_NEAR(change[e], along(of_level, e), 1e-4) << "seed " << seed << ", constraint " << e;
  }
}

// A creature whose rest lengths were fitted to what its clip pulls far apart: levels get theirs likewise, and are without stress where it is.
TEST(AtLevel, CarriesAStretchBeyondWhatSpringsBearByRestLengthsOfItsOwn) {
  const double longer = 1.8, across = 1 / std::sqrt(longer);
  const Eigen::Matrix3d deform = Eigen::Vector3d(longer, across, across).asDiagonal();
  Solved solved = floating_block(90, deform);
  const auto wanted_by = [&deform](const physics::Body& body) {
    return Eigen::RowVectorXd(stress_free(body, deform).array() / natural_stretch(body).transpose().array());
  };
  const auto want = [&](double share) {
    set_signals(share * wanted_by(solved.performer.scene.body), solved);
    solved.signals.limit = kMostSpringStrain;
  };
  want(1);
  const auto level = [&solved] { return at_level(solved.performer, solved.signals, solved.rig, options_for(kSanitized ? 40 : 200, false)); };
  EXPECT_FALSE(has_fitted_rest_lengths(level().performer.scene.body));
  physics::Body& body = solved.performer.scene.body;
  fit_rest_lengths(solved.performer.prepared.target, body);
  ASSERT_TRUE(has_fitted_rest_lengths(body));
  want(1);
  const Level fitted = level();
  const physics::Body& of_level = fitted.performer.scene.body;
  EXPECT_TRUE(has_fitted_rest_lengths(of_level));
  EXPECT_LT((played(fitted).transpose() - wanted_by(of_level)).cwiseAbs().maxCoeff(), 1e-5);
  // And an edit is the same strain there, whatever the rest lengths: of 1 % along every constraint.
  want(1.01);
  EXPECT_LT((played(level()).transpose().array() / wanted_by(of_level).array() - 1.01).abs().maxCoeff(), 2e-3);
}

// A level of finite elements reads logarithms where springs have squares: the same small strain is half of it there.
TEST(AtLevel, OfElementsStandsWhereSpringsDoAndFeelsWhatWasDoneToThem) {
  Solved solved = standing_block(40);
  const physics::Body& body = solved.performer.scene.body;
  const Eigen::RowVectorXd before = signal::synthesise_samples(solved.signals.activation, solved.signals.samples()).row(0);
  const Level plain = at_level(solved.performer, solved.signals, solved.rig, options_for(40, true));
  const physics::Scene& scene = plain.performer.scene;
  ASSERT_FALSE(scene.body.elements.empty());
  const Eigen::VectorXd bearing = played(plain);
  EXPECT_LT(moved(scene, scene.body.rest, bearing), 0.2 * moved(scene, scene.body.rest, Eigen::VectorXd::Ones(bearing.size())));
  constexpr double kStrain = 0.01;
  Eigen::RowVectorXd edited = before;
  for (int e = 0; e < body.edge_count(); ++e) edited[e] = std::sqrt(before[e] * before[e] + 2 * kStrain);
  set_signals(edited, solved);
  const Eigen::VectorXd after = played(at_level(solved.performer, solved.signals, solved.rig, options_for(40, true)));
  EXPECT_LT(((after.array() / bearing.array()).log() - kStrain).abs().maxCoeff(), 0.02 * kStrain);
}

// A user who narrows the muscles' reach has them narrower on the levels, too; layers come along as they are.
TEST(AtLevel, KeepsTheLimitAndTheLayersOfTheSolvedCreature) {
  Solved solved = standing_block(40);
  signal::Layer layer;
  layer.name = "stronger";
  solved.signals.layers.push_back(layer);
  const Level wide = at_level(solved.performer, solved.signals, solved.rig, options_for(90, false));
  solved.signals.limit = kLimit / 3;
  const Level narrow = at_level(solved.performer, solved.signals, solved.rig, options_for(90, false));
  EXPECT_NEAR(narrow.signals.limit, wide.signals.limit / 3, 1e-12);
  EXPECT_LE((played(narrow).array() - 1).abs().maxCoeff(), narrow.signals.limit + 1e-6);
  ASSERT_EQ(wide.signals.layers.size(), 1u);
  EXPECT_EQ(wide.signals.layers[0].name, layer.name);
}

TEST(LevelCosts, FallWithTheNodesAndAreTheSameEachTime) {
  const Solved solved = floating_block(40, Eigen::Matrix3d::Identity());
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

/// A worm that lies on the ground, with a corrector that makes the muscles' response anew at each call.
struct Corrected {
  explicit Corrected(int nodes) : creature(make_creature(worm(), options_for(nodes, false))) {
    contact.touching.assign(static_cast<std::size_t>(scene.contact_points.count()), ContactState::kStick);
    contact.bearing.assign(contact.touching.size(), false);
    contact.force.setZero(3, scene.contact_points.count());
  }
  static CorrectorOptions anew() {
    CorrectorOptions options;
    options.response_every = 1;
    return options;
  }
  /// Processor time of one call, where that is less than before.
  void time() {
    Eigen::VectorXd activation = Eigen::VectorXd::Ones(scene.body.edge_count());
    const double began = thread_seconds();
    corrector.correct(rest, rest, contact, activation);
    least_s = std::min(least_s, thread_seconds() - began);
  }
  double counted_ms() const { return counted_ms_of_correction(scene, muscles.fields.cols()); }

  Creature creature;
  const physics::Scene& scene = creature.scene;
  Muscles muscles = make_muscles(scene.body, creature.character.skeleton, creature.mesh.bone_weights);
  Corrector corrector{scene, muscles, creature.length, kLimit, anew()};
  ContactNow contact;
  physics::State rest{scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count()), {}};
  double least_s = 1e300;
};

// The choice of a level goes by counted work: between levels it has to grow as the time does. Other work on the machine only
// adds to a time, so that the least of many counts.
TEST(CountedWork, OfCorrectionsGrowsWithTheNodesAsTheirTimeDoes) {
  if (kSanitized) return;
  Corrected coarse(60), fine(200);
  for (int run = 0; run < 40; ++run) {
    coarse.time();
    fine.time();
  }
  const double grown = fine.least_s / coarse.least_s;
  EXPECT_GT(grown, 2);
  EXPECT_GT(fine.counted_ms() / coarse.counted_ms(), grown / 1.6);
  EXPECT_LT(fine.counted_ms() / coarse.counted_ms(), grown * 1.6);
}

}  // namespace
}  // namespace hydrostat::retarget::level_test

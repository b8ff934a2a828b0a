#include "retarget/level.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "retarget/bear_loads.h"
#include "retarget/level_target.h"
#include "retarget/mesh_places.h"
#include "retarget/self_contact_plan.h"
#include "retarget/tensor_field.h"

namespace hydrostat::retarget {
namespace {

constexpr double kLeastSquare = 0.01;  // of a stretch or activation

/// [m], E x F.
Eigen::MatrixXd edge_lengths(const physics::Body& body, const Motion& target) {
  Eigen::MatrixXd lengths(body.edge_count(), target.count());
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const auto x = target.at(f);
    lengths.col(f) = (x(Eigen::all, body.edges.row(1)) - x(Eigen::all, body.edges.row(0))).colwise().norm();
  }
  return lengths;
}

/// What of a body's deformation adds up with what its activations ask, along each constraint, so that a uniform strain is a
/// field of tensors: springs are at rest where their activation is the stretch, F^T F along the constraint is its square;
/// elements, where the logarithms of their activations fit the logarithm of U, F = R U (physics/element_activation.h).
bool is_logarithmic(const physics::Body& body) { return !body.elements.empty(); }

Eigen::MatrixXd measures_of(const physics::Body& body, const Eigen::MatrixXd& activation) {
  return is_logarithmic(body) ? activation.array().log().matrix().eval() : activation.cwiseAbs2().eval();
}

Eigen::MatrixXd activations_of(const physics::Body& body, const Eigen::MatrixXd& measures) {
  return is_logarithmic(body) ? measures.array().exp().matrix().eval() : measures.cwiseMax(kLeastSquare).cwiseSqrt().eval();
}

/// Adds to the logarithms of the stretches (E) what makes them n^T log U n where the strain is uniform: the mean over the
/// elements at each constraint.
void add_mean_strains(const physics::Body& body, const Eigen::Ref<const Eigen::Matrix3Xd>& x,
                      Eigen::Ref<Eigen::VectorXd> logarithms) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(body.edge_count()), count = sum;
  for (const physics::BodyElements<3>& elements : body.elements) {
    for (Eigen::Index e = 0; e < elements.block.nodes.cols(); ++e) {
      Eigen::Matrix3Xd rest = body.rest(Eigen::all, elements.block.nodes.col(e));
      Eigen::Matrix3Xd now = x(Eigen::all, elements.block.nodes.col(e));
      rest.colwise() -= rest.rowwise().mean().eval();
      now.colwise() -= now.rowwise().mean().eval();
      const Eigen::Matrix3d F = (now * rest.transpose()) * (rest * rest.transpose()).inverse();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> squared(F.transpose() * F);
      const Eigen::Matrix3d& axes = squared.eigenvectors();
      const Eigen::Vector3d strains = 0.5 * squared.eigenvalues().array().max(kLeastSquare).log();
      for (const int pair : elements.fit.of_element.col(e)) {
        const Eigen::Vector3d n = (body.rest.col(body.edges(1, pair)) - body.rest.col(body.edges(0, pair))).normalized();
        sum[pair] += strains.dot((axes.transpose() * n).cwiseAbs2()) - std::log((F * n).norm());
        count[pair] += 1;
      }
    }
  }
  logarithms += sum.cwiseQuotient(count.cwiseMax(1));
}

/// The measure of the target, E x F.
Eigen::MatrixXd target_measures(const physics::Body& body, const Motion& target) {
  Eigen::MatrixXd measures =
      measures_of(body, (edge_lengths(body, target).array().colwise() / body.rest_length.array()).matrix());
  if (!is_logarithmic(body)) return measures;
  for (Eigen::Index f = 0; f < target.count(); ++f) add_mean_strains(body, target.at(f), measures.col(f));
  return measures;
}

/// The nominal path on the level: of its nodes as of what lies there in the solved creature.
Motion carried_offset(const Motion& solved, const Places& places) {
  Motion carried = solved;
  carried.frames.resize(places.nodes.cols() * 3, solved.count());
  for (Eigen::Index f = 0; f < solved.count(); ++f) {
    const Eigen::Map<const Eigen::Matrix3Xd> from = solved.at(f);
    for (Eigen::Index i = 0; i < places.nodes.cols(); ++i) carried.at(f).col(i) = from(Eigen::all, places.nodes.col(i)) * places.weights.col(i);
  }
  return carried;
}

NominalPath carried_path(const Performer& solved, const Rig& rig, const Performer& level, const Eigen::MatrixXd& bone_weights) {
  if (solved.path.is_empty()) return {};
  const Places places = locate(solved.mesh, rig.bone_weights, level.mesh.nodes, bone_weights);
  return {carried_offset(solved.path.place, places), carried_offset(solved.path.velocity, places)};
}

SignalSet carried_signals(const Performer& solved, const SignalSet& signals, const Rig& rig, const Performer& level) {
  const physics::Body& body = level.scene.body;
  const Eigen::MatrixXd activation = signal::synthesise_samples(signals.activation, signals.samples()).transpose();
  const Eigen::MatrixXd loads =
      measures_of(solved.scene.body, activation) - target_measures(solved.scene.body, solved.prepared.target);
  const Eigen::MatrixXd tensors = tensors_along(solved.scene.body.rest, solved.scene.body.edges, loads);
  Eigen::MatrixXd carried =
      activations_of(body, target_measures(body, level.prepared.target) +
                               values_along(tensors, solved.mesh, rig.bone_weights, level.mesh, body.edges));
  bear_loads(level, carried);
  carried = carried.cwiseMax(1 - signals.limit).cwiseMin(1 + signals.limit).eval();
  const Eigen::MatrixXd lengths = edge_lengths(body, level.prepared.target).transpose();
  const SolvedSignals result{signals.kind(),
                             signals.period_s,
                             signals.limit,
                             carried.transpose(),
                             penalty_forces(carried.transpose(), lengths, body.rest_length, body.edge_stiffness),
                             level.muscles.edge_bone,
                             body.edges,
                             body.rest_length,
                             body.edge_stiffness};
  SignalOptions options;
  options.harmonics = signals.activation.harmonics();
  SignalSet set = analyse_signals(result, options);
  set.layers = signals.layers;
  return set;
}

/// What of their mass the solved creature's nodes have kept, on the level's.
void carry_mass(const Performer& solved, const Rig& rig, Creature& level) {
  const Eigen::VectorXd& shares = solved.prepared.mass_shares;
  if (shares.size() == 0) return;
  const Places places = locate(solved.mesh, rig.bone_weights, level.mesh.nodes, level.mesh.bone_weights);
  for (Eigen::Index i = 0; i < level.scene.body.mass.size(); ++i)
    level.scene.body.mass[i] *= shares(places.nodes.col(i)).dot(places.weights.col(i));
}

}  // namespace

Creature level_body(const Rig& rig, const CreatureOptions& options, int nodes) {
  CreatureOptions wished = options;
  wished.nodes = nodes;
  wished.height_m = rig.skin.vertices.row(1).maxCoeff() - rig.skin.vertices.row(1).minCoeff();  // as it is
  return make_creature({rig.skeleton, rig.skin, {}}, wished);
}

Level at_level(const Performer& solved, const SignalSet& signals, const Rig& rig, const CreatureOptions& options) {
  Creature creature = level_body(rig, options, options.nodes);
  carry_mass(solved, rig, creature);
  creature.scene.ground = solved.scene.ground;
  creature.scene.gravity = solved.scene.gravity;
  Level level;
  Performer& performer = level.performer;
  performer = solved;
  performer.embedding = creature.skin;
  performer.mesh = creature.mesh;
  performer.contacts = creature.contacts;
  performer.scene = creature.scene;
  performer.muscles = make_muscles(creature.scene.body, rig.skeleton, creature.mesh.bone_weights);
  performer.prepared = carried_target(solved, rig, creature);
  performer.path = carried_path(solved, rig, performer, creature.mesh.bone_weights);
  performer.clip_points = carried_clip_points(solved, creature.contacts);
  SelfContactPlan plan = plan_self_contact(performer);
  performer.scene.self_contact = std::move(plan.settings);
  performer.self_contact_reason = std::move(plan.reason);
  const std::string wobble = solved.wobble.is_on() ? "not planned on this level" : solved.wobble.reason;
  performer.wobble = {};  // its modes are of the solved mesh
  performer.wobble.reason = wobble;
  level.signals = carried_signals(solved, signals, rig, performer);
  return level;
}

}  // namespace hydrostat::retarget

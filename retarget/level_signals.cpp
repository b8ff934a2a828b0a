#include "retarget/level_signals.h"

#include <algorithm>
#include <cmath>

#include "retarget/inverse_dynamics.h"
#include "retarget/rest_lengths.h"
#include "retarget/tensor_field.h"

namespace hydrostat::retarget {
namespace {

constexpr double kLeastSquare = 0.01;  // of an activation
constexpr double kLargestLimit = 0.9;
constexpr double kNoChange = 1e-6;  // of an activation's square or logarithm: what solving anew leaves

/// [m], F x E.
Eigen::MatrixXd edge_lengths(const physics::Body& body, const Motion& target) {
  Eigen::MatrixXd lengths(target.count(), body.edge_count());
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const auto x = target.at(f);
    lengths.row(f) = (x(Eigen::all, body.edges.row(1)) - x(Eigen::all, body.edges.row(0))).colwise().norm();
  }
  return lengths;
}

/// What of activations adds up along each constraint, so that a uniform strain is a field of tensors: of springs, which are at
/// rest where their activation, from the rest length that they have, is the stretch, F^T F along the constraint is its square; of elements
/// the logarithms fit that of U, F = R U (physics/element_activation.h).
Eigen::MatrixXd measures_of(const physics::Body& body, const Eigen::MatrixXd& activation) {
  if (!body.elements.empty()) return activation.array().log();
  return (natural_stretch(body).asDiagonal() * activation).cwiseAbs2();
}

Eigen::MatrixXd activations_of(const physics::Body& body, const Eigen::MatrixXd& measures) {
  if (!body.elements.empty()) return measures.array().exp();
  return natural_stretch(body).cwiseInverse().asDiagonal() * measures.cwiseMax(kLeastSquare).cwiseSqrt();
}

/// How fast measures grow with a body's activations, where these are 1.
double slope_of(const physics::Body& body) { return body.elements.empty() ? 2 : 1; }

/// What the inverse dynamics ask of a body for its target.
SignalSet own_plan(const Performer& performer, double limit, int harmonics) {
  const physics::Body& body = performer.scene.body;
  const Motion& target = performer.prepared.target;
  InverseOptions inverse;
  inverse.limit = limit;
  const InverseDynamics found = solve_inverse_dynamics(performer.prepared, performer.scene, performer.length, inverse);
  const SolvedSignals solved{target.loop ? signal::Kind::loop : signal::Kind::one_shot,
                             target.duration_s(),
                             limit,
                             found.activation.transpose(),
                             found.penalty_force.transpose(),
                             performer.muscles.edge_bone,
                             body.edges,
                             body.rest_length,
                             body.edge_stiffness};
  SignalOptions options;
  options.harmonics = harmonics;
  return analyse_signals(solved, options);
}

double level_limit(const Performer& solved, double limit, const Performer& level) {
  const double wider = automatic_limit(level.scene.body, level.prepared.target) /
                       automatic_limit(solved.scene.body, solved.prepared.target);
  return std::min(kLargestLimit, limit * wider);
}

/// What was done to the solved signals since they were solved, in measures along the level's constraints, E x F; empty: nothing.
Eigen::MatrixXd carried_changes(const Performer& solved, const SignalSet& signals, const Rig& rig, const Performer& level) {
  const physics::Body& body = solved.scene.body;
  const SignalSet own = own_plan(solved, signals.limit, signals.activation.harmonics());
  const auto measures = [&](const SignalSet& set) {
    return measures_of(body, signal::synthesise_samples(set.activation, signals.samples()).transpose());
  };
  const Eigen::MatrixXd changes = (slope_of(level.scene.body) / slope_of(body)) * (measures(signals) - measures(own));
  if (changes.cwiseAbs().maxCoeff() < kNoChange) return {};
  const Eigen::MatrixXd tensors = tensors_along(body.rest, body.edges, changes);
  return values_along(tensors, solved.mesh, rig.bone_weights, level.mesh, level.scene.body.edges);
}

/// The changes made to a plan, within its limit.
void add_changes(const Performer& level, const Eigen::MatrixXd& changes, SignalSet& plan) {
  const physics::Body& body = level.scene.body;
  const Eigen::MatrixXd activation = signal::synthesise_samples(plan.activation, plan.samples()).transpose();
  const Eigen::MatrixXd changed = activations_of(body, measures_of(body, activation) + changes)
                                      .cwiseMax(1 - plan.limit)
                                      .cwiseMin(1 + plan.limit)
                                      .transpose();
  const Eigen::MatrixXd lengths = edge_lengths(body, level.prepared.target);
  const int harmonics = plan.activation.harmonics();
  plan.activation = signal::analyse(plan.kind(), changed, harmonics);
  plan.force = signal::analyse(plan.kind(), penalty_forces(changed, lengths, body.rest_length, body.edge_stiffness), harmonics);
}

}  // namespace

SignalSet level_signals(const Performer& solved, const SignalSet& signals, const Rig& rig, const Performer& level) {
  SignalSet plan = own_plan(level, level_limit(solved, signals.limit, level), signals.activation.harmonics());
  const Eigen::MatrixXd changes = carried_changes(solved, signals, rig, level);
  if (changes.size() > 0) add_changes(level, changes, plan);
  plan.layers = signals.layers;
  return plan;
}

}  // namespace hydrostat::retarget

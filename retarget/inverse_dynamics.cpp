#include "retarget/inverse_dynamics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

#include "physics/elastic_forces.h"
#include "physics/internal_forces.h"
#include "retarget/balance.h"
#include "retarget/leaps.h"
#include "retarget/least_squares.h"

namespace hydrostat::retarget {
namespace {

constexpr double kTie = 10;  // weight of the rows that tie y to the residual force: they give way by 1 % of the metric of a rigid mode, less elsewhere
constexpr int kFirstRounds = 6,
              kLaterRounds = 1;         // of linearising the forces of elements, in the first sweep and in those after it
constexpr double kSettledActivation = 0.01;  // change of an activation that ends the rounds
constexpr double kLeastLimit = 0.1;          // of |activation - 1|, where it is chosen
constexpr double kShapeShare = 0.99;         // of the target's strains that the limit holds,
constexpr double kMostHeld = 0.03;           // share of the activations that it may hold
constexpr double kWiden = 1.5;               // times as wide where it holds more
constexpr double kCarries = 1e-6;            // share of a contact point from which a node carries it
constexpr double kForceWeight = 0.1;         // per contact force in m g, in mm per m of L: makes the split of loads unique

/// Everything about one frame that does not change from sweep to sweep.
struct Frame {
  BoundedLeastSquares problem;           // unknowns: y (3N, per mm per m of L), u (E), alpha (per m g)
  std::vector<ContactGenerator> generators;
  Eigen::VectorXd kinematic;             // u_kin, E
  Eigen::VectorXd solution;
  long shape_row = 0;                    // first of the E rows that hold u to its wish
  double kkt_residual = 0;
};

struct Dynamics {
  const physics::Scene& scene;
  const PreparedTarget& prepared;
  Eigen::MatrixXd velocity, acceleration;
  double length, unit, weight;           // unit [m]: a thousandth of L
};

Eigen::VectorXd kinematic_activation(const physics::Body& body, const physics::ConstPoints& x, double limit) {
  Eigen::VectorXd u(body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e) {
    const double length = (x.col(body.edges(1, e)) - x.col(body.edges(0, e))).norm();
    u[e] = std::clamp(length / body.rest_length[e] - 1, -limit, limit);
  }
  return u;
}

/// The nodes that carry what bears in a frame.
std::vector<bool> bearing_nodes(const physics::Scene& scene, const ContactSchedule& contacts, Eigen::Index frame) {
  std::vector<bool> bear(static_cast<std::size_t>(scene.body.node_count()), false);
  const physics::ContactPoints& points = scene.contact_points;
  for (int p = 0; p < points.count(); ++p) {
    if (!contacts.touching(p, frame)) continue;
    for (int corner = 0; corner < points.nodes.rows(); ++corner) {
      if (points.weights(corner, p) > kCarries) bear[static_cast<std::size_t>(points.nodes(corner, p))] = true;
    }
  }
  return bear;
}

/// [m/s], 3N x F: central differences, but for what takes off: it stands until its last frame on the ground ends, whatever it does then. With the mean of
/// both speeds the dashpots above it pull less than they are going to, and the feet come off before the push is over. Of a loop,
/// whose next hop makes up for this one, central differences are the better ones (measured, a frog's: it rises too high as it is).
Eigen::MatrixXd velocities_on_ground(const PreparedTarget& prepared, const physics::Scene& scene) {
  const Motion& target = prepared.target;
  Eigen::MatrixXd result = velocities(target);
  if (target.loop) return result;
  const std::vector<bool> flying = frames_in_flight(prepared.contacts, target.rate_hz, target.loop);
  for (Eigen::Index f = 1; f + 1 < target.count(); ++f) {
    if (flying[static_cast<std::size_t>(f)] || !flying[static_cast<std::size_t>(f + 1)]) continue;
    const std::vector<bool> bear = bearing_nodes(scene, prepared.contacts, f);
    for (Eigen::Index i = 0; i < scene.body.node_count(); ++i) {
      if (!bear[static_cast<std::size_t>(i)]) continue;
      result.col(f).segment<3>(3 * i) = target.rate_hz * (target.at(f).col(i) - target.at(f - 1).col(i));
    }
  }
  return result;
}

/// rho [N], 3 x N: what contact and a change of the activations that `forces` holds must provide.
Eigen::Matrix3Xd wanted_force(const Dynamics& dynamics, const physics::InternalForces<3>& forces, Eigen::Index f) {
  const physics::Body& body = dynamics.scene.body;
  const Eigen::Matrix3Xd x = dynamics.prepared.target.at(f);
  const Eigen::Map<const Eigen::Matrix3Xd> v(dynamics.velocity.data() + f * dynamics.velocity.rows(), 3, x.cols());
  const Eigen::Map<const Eigen::Matrix3Xd> a(dynamics.acceleration.data() + f * dynamics.acceleration.rows(), 3, x.cols());
  Eigen::Matrix3Xd internal = Eigen::Matrix3Xd::Zero(3, x.cols());
  forces.add_elastic_forces(x, internal);
  physics::add_damping_forces(body, x, v, internal);
  Eigen::Matrix3Xd rho(3, x.cols());
  for (int i = 0; i < body.node_count(); ++i)
    rho.col(i) = body.mass[i] * (a.col(i) - dynamics.scene.gravity) - internal.col(i);
  return rho;
}

/// A at the activations that `forces` holds.
void assemble_compliance(const Dynamics& dynamics, const physics::InternalForces<3>& forces, const Eigen::Matrix3Xd& x,
                         double ts, physics::SystemMatrix& matrix) {
  const physics::Body& body = dynamics.scene.body;
  matrix.set_zero();
  matrix.add_mass(body, 1);
  matrix.add_damping(body, x, ts);
  forces.add_stiffness(x, ts * ts, matrix);
}

/// The frame's problem with the forces linear in the activations about `at` (u, E); the metric A is that of the kinematic
/// ones.
void linearise(const Dynamics& dynamics, Eigen::Index f, const Eigen::VectorXd& at, Frame& frame) {
  const physics::Body& body = dynamics.scene.body;
  const physics::ContactPoints& points = dynamics.scene.contact_points;
  const Eigen::Matrix3Xd x = dynamics.prepared.target.at(f);
  const double ts = 1 / dynamics.prepared.target.rate_hz, mass = body.mass.sum();
  const int nodes = body.node_count(), edges = body.edge_count();
  physics::InternalForces<3> internal(body);
  internal.set_activation(frame.kinematic.array() + 1);
  physics::SystemMatrix matrix(body);
  assemble_compliance(dynamics, internal, x, ts, matrix);
  const Eigen::SparseMatrix<double> a = matrix.lower().selfadjointView<Eigen::Lower>();
  internal.set_activation(at.array() + 1);
  Eigen::Matrix3Xd rho = wanted_force(dynamics, internal, f);
  const Eigen::SparseMatrix<double> b = internal.force_per_activation(x);
  rho += (b * at).reshaped(3, nodes);

  const int forces = static_cast<int>(frame.generators.size()), columns = 3 * nodes + edges + forces;
  const int rows = 3 * nodes + 3 * nodes + edges + forces;
  BoundedLeastSquares& problem = frame.problem;
  std::vector<Eigen::Triplet<double>> entries;
  problem.target = Eigen::VectorXd::Zero(rows);
  // Rows of node i are scaled by row_scale: a displacement in units of a thousandth of L, mass-weighted.
  Eigen::VectorXd row_scale(nodes);
  for (int i = 0; i < nodes; ++i) row_scale[i] = kTie * std::sqrt(body.mass[i] / mass) / (body.mass[i] * dynamics.unit);
  for (int c = 0; c < a.outerSize(); ++c) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(a, c); it; ++it) {
      entries.emplace_back(it.row(), c, row_scale[it.row() / 3] * it.value() * dynamics.unit);
    }
  }
  for (int e = 0; e < edges; ++e) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(b, e); it; ++it) {
      entries.emplace_back(it.row(), 3 * nodes + e, row_scale[it.row() / 3] * ts * ts * it.value());
    }
  }
  const auto add_force = [&](int node, const Eigen::Vector3d& force, int column) {
    for (int r = 0; r < 3; ++r) entries.emplace_back(3 * node + r, column, row_scale[node] * ts * ts * force[r]);
  };
  for (int k = 0; k < forces; ++k) {
    const ContactGenerator& g = frame.generators[static_cast<std::size_t>(k)];
    for (int corner = 0; corner < 4; ++corner) {
      add_force(points.nodes(corner, g.point), points.weights(corner, g.point) * dynamics.weight * g.force, 3 * nodes + edges + k);
    }
  }
  for (int i = 0; i < nodes; ++i) problem.target.segment<3>(3 * i) = row_scale[i] * ts * ts * rho.col(i);
  for (int i = 0; i < nodes; ++i) {
    for (int r = 0; r < 3; ++r) entries.emplace_back(3 * nodes + 3 * i + r, 3 * i + r, std::sqrt(body.mass[i] / mass));
  }
  frame.shape_row = 6 * nodes;
  for (int e = 0; e < edges; ++e) entries.emplace_back(frame.shape_row + e, 3 * nodes + e, 1.0);  // scaled per sweep
  for (int k = 0; k < forces; ++k) entries.emplace_back(frame.shape_row + edges + k, 3 * nodes + edges + k, kForceWeight);
  problem.jacobian.resize(rows, columns);
  problem.jacobian.setFromTriplets(entries.begin(), entries.end());
}

Frame make_frame(const Dynamics& dynamics, Eigen::Index f, const InverseOptions& options) {
  const physics::Body& body = dynamics.scene.body;
  const int nodes = body.node_count(), edges = body.edge_count();
  Frame frame;
  frame.generators =
      contact_generators(dynamics.prepared.contacts, f, dynamics.scene.ground.friction, dynamics.prepared.support_friction);
  frame.kinematic = kinematic_activation(body, dynamics.prepared.target.at(f), options.limit);
  const int forces = static_cast<int>(frame.generators.size()), columns = 3 * nodes + edges + forces;
  BoundedLeastSquares& problem = frame.problem;
  problem.lower = Eigen::VectorXd::Constant(columns, -std::numeric_limits<double>::infinity());
  problem.upper = Eigen::VectorXd::Constant(columns, std::numeric_limits<double>::infinity());
  problem.lower.segment(3 * nodes, edges).setConstant(-options.limit);
  problem.upper.segment(3 * nodes, edges).setConstant(options.limit);
  problem.lower.tail(forces).setZero();
  problem.coupled_rows = 3 * nodes;
  const int rows = 6 * nodes + edges + forces;
  for (int i = 0; i <= nodes; ++i) problem.column_blocks.push_back(3 * i);
  for (int c = 3 * nodes + 1; c <= columns; ++c) problem.column_blocks.push_back(c);
  for (int r = 0; r <= 2 * nodes; ++r) problem.row_blocks.push_back(3 * r);
  for (int r = 6 * nodes + 1; r <= rows; ++r) problem.row_blocks.push_back(r);
  frame.solution = Eigen::VectorXd::Zero(columns);
  frame.solution.segment(3 * nodes, edges) = frame.kinematic * 0.999;
  frame.solution.tail(forces).setConstant(forces > 0 ? 1.0 / forces : 0);
  return frame;
}

/// Solves one frame for the wish of its sweep.
void solve_frame(Frame& frame, const Eigen::VectorXd& wish, double weight_per_edge) {
  const long edges = wish.size();
  const double scale = std::sqrt(weight_per_edge);
  for (long e = 0; e < edges; ++e) {
    const long row = frame.shape_row + e;
    frame.problem.jacobian.valuePtr()[frame.problem.jacobian.outerIndexPtr()[row]] = scale;
    frame.problem.target[row] = scale * wish[e];
  }
  const BoundedSolution solution = solve(frame.problem, frame.solution);
  frame.solution = solution.x;
  frame.kkt_residual = solution.kkt_residual;
}

/// Solves one frame for the wish of its sweep. What springs do is linear in the activations; the forces of elements are
/// linearised again about every solution (Gauss and Newton).
void solve_frame(const Dynamics& dynamics, Eigen::Index f, const Eigen::VectorXd& wish, double weight_per_edge,
                 bool is_first, Frame& frame) {
  const physics::Body& body = dynamics.scene.body;
  const Eigen::Index first = 3 * body.node_count(), edges = body.edge_count();
  if (body.elements.empty()) {
    if (is_first) linearise(dynamics, f, Eigen::VectorXd::Zero(edges), frame);
    return solve_frame(frame, wish, weight_per_edge);
  }
  for (int round = 0; round < (is_first ? kFirstRounds : kLaterRounds); ++round) {
    const Eigen::VectorXd before = frame.solution.segment(first, edges);
    linearise(dynamics, f, before, frame);
    solve_frame(frame, wish, weight_per_edge);
    if ((frame.solution.segment(first, edges) - before).cwiseAbs().maxCoeff() < kSettledActivation) break;
  }
}

}  // namespace

double automatic_limit(const physics::Body& body, const Motion& target) {
  std::vector<double> strains;
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const Eigen::VectorXd u = kinematic_activation(body, target.at(f), 10);
    for (const double strain : u) strains.push_back(std::abs(strain));
  }
  const auto place = strains.begin() + static_cast<long>(kShapeShare * static_cast<double>(strains.size() - 1));
  std::nth_element(strains.begin(), place, strains.end());
  return std::clamp(*place, kLeastLimit, kMostAutomaticLimit);
}

InverseDynamics solve_inverse_dynamics(const PreparedTarget& prepared, const physics::Scene& scene, double length,
                                       const InverseOptions& options) {
  const physics::Body& body = scene.body;
  const Motion& target = prepared.target;
  const long frames = target.count(), edges = body.edge_count(), nodes = body.node_count();
  const Dynamics dynamics{scene,  prepared,      velocities_on_ground(prepared, scene),        accelerations(target, prepared.ends),
                          length, length * 1e-3, body.mass.sum() * scene.gravity.norm()};
  std::vector<Frame> work(static_cast<std::size_t>(frames));
  std::vector<Eigen::VectorXd> previous(static_cast<std::size_t>(frames));
  // u of frame f for the smoothness term: loops go round, one-shots repeat their ends.
  const auto u_of = [&](long f) -> const Eigen::VectorXd& {
    f = target.loop ? (f + 2 * frames) % frames : std::clamp(f, 0L, frames - 1);
    return previous[static_cast<std::size_t>(f)];
  };
  for (int sweep = 0; sweep < options.sweeps; ++sweep) {
    const auto do_frame = [&](long f) {
      Frame& frame = work[static_cast<std::size_t>(f)];
      if (sweep == 0) {
        frame = make_frame(dynamics, f, options);
        solve_frame(dynamics, f, frame.kinematic, options.shape_weight / static_cast<double>(edges), true, frame);
        return;
      }
      // The terms with u_t of the three second differences around t, as one square, halfway to their minimum (Jacobi, damped).
      const Eigen::VectorXd middle = (4 * (u_of(f - 1) + u_of(f + 1)) - u_of(f - 2) - u_of(f + 2)) / 6;
      const Eigen::VectorXd damped = 0.5 * (middle + u_of(f));
      const double smooth = 6 * options.smooth_weight;
      const Eigen::VectorXd wish = (options.shape_weight * frame.kinematic + smooth * damped) / (options.shape_weight + smooth);
      solve_frame(dynamics, f, wish, (options.shape_weight + smooth) / static_cast<double>(edges), false, frame);
    };
    std::vector<std::thread> threads;
    const long count = std::max(1, options.threads);
    for (long k = 0; k < count; ++k) {
      threads.emplace_back([&, k] {
        for (long f = k; f < frames; f += count) do_frame(f);
      });
    }
    for (std::thread& thread : threads) thread.join();
    for (long f = 0; f < frames; ++f) previous[static_cast<std::size_t>(f)] = work[static_cast<std::size_t>(f)].solution.segment(3 * nodes, edges);
  }

  InverseDynamics result;
  result.activation.resize(edges, frames);
  result.penalty_force.resize(edges, frames);
  result.contact_force = Eigen::MatrixXd::Zero(3 * scene.contact_points.count(), frames);
  result.miss.resize(frames);
  physics::SystemMatrix matrix(body);
  physics::InternalForces<3> internal(body);
  double root_squared = 0;
  long saturated = 0;
  std::vector<double> strains;
  for (long f = 0; f < frames; ++f) {
    const Frame& frame = work[static_cast<std::size_t>(f)];
    const Eigen::Matrix3Xd x = target.at(f);
    const Eigen::VectorXd u = frame.solution.segment(3 * nodes, edges);
    result.activation.col(f) = u.array() + 1;
    internal.set_activation(result.activation.col(f));
    Eigen::Matrix3Xd residual = wanted_force(dynamics, internal, f);
    result.penalty_force.col(f) = internal.tensions(x);
    for (int e = 0; e < edges; ++e) {
      const double now = (x.col(body.edges(1, e)) - x.col(body.edges(0, e))).norm();
      saturated += std::abs(u[e]) > 0.999 * options.limit ? 1 : 0;
      strains.push_back(std::abs(now / body.rest_length[e] - 1));
    }
    for (std::size_t k = 0; k < frame.generators.size(); ++k) {
      const ContactGenerator& g = frame.generators[k];
      const Eigen::Vector3d force = frame.solution[3 * nodes + edges + static_cast<long>(k)] * dynamics.weight * g.force;
      result.contact_force.col(f).segment<3>(3 * g.point) += force;
      for (int corner = 0; corner < 4; ++corner) {
        residual.col(scene.contact_points.nodes(corner, g.point)) -= scene.contact_points.weights(corner, g.point) * force;
      }
    }
    root_squared += residual.rowwise().sum().squaredNorm() / (dynamics.weight * dynamics.weight) / static_cast<double>(frames);
    const double ts = 1 / target.rate_hz;
    internal.set_activation(frame.kinematic.array() + 1);
    assemble_compliance(dynamics, internal, x, ts, matrix);
    matrix.factor();
    Eigen::MatrixXd miss = Eigen::Map<Eigen::VectorXd>(residual.data(), residual.size());
    matrix.solve_in_place(miss);
    const Eigen::Map<const Eigen::Matrix3Xd> y(miss.data(), 3, nodes);
    result.miss[f] = ts * ts * std::sqrt((y.colwise().squaredNorm() * body.mass)(0) / body.mass.sum());
    result.report.kkt_residual = std::max(result.report.kkt_residual, frame.kkt_residual);
  }
  result.report.miss_rms_length = std::sqrt(result.miss.squaredNorm() / static_cast<double>(frames)) / length;
  result.report.root_residual_mg = std::sqrt(root_squared);
  result.report.saturated = static_cast<double>(saturated) / static_cast<double>(frames * edges);
  result.report.limit = options.limit;
  std::sort(strains.begin(), strains.end());
  result.report.max_strain = strains.back();
  result.report.p95_strain = strains[static_cast<std::size_t>(0.95 * static_cast<double>(strains.size() - 1))];
  return result;
}

InverseDynamics solve_within_automatic_limit(const PreparedTarget& prepared, const physics::Scene& scene, double length,
                                             const InverseOptions& options) {
  InverseOptions within = options;
  within.limit = automatic_limit(scene.body, prepared.target);
  for (;;) {
    InverseDynamics inverse = solve_inverse_dynamics(prepared, scene, length, within);
    if (inverse.report.saturated <= kMostHeld || within.limit >= kMostAutomaticLimit) return inverse;
    within.limit = std::min(kMostAutomaticLimit, kWiden * within.limit);
  }
}

}  // namespace hydrostat::retarget

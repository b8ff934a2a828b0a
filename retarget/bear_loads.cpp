#include "retarget/bear_loads.h"

#include <cmath>

#include "physics/internal_forces.h"
#include "physics/system_matrix.h"
#include "retarget/balance.h"
#include "retarget/least_squares.h"

namespace hydrostat::retarget {
namespace {

constexpr double kHorizon = 1.0 / 30;   // [s], T
constexpr double kGroundBalance = 100;  // of what the ground's forces leave, per weight, beside the forces themselves
constexpr double kMissUnit = 1e-3;      // of L
constexpr double kEffort = 1;           // per squared activation, mean over the constraints, in squares of that unit
constexpr int kRounds = 60;
constexpr double kLeastSlope = 1e-3;  // of the first

/// The ground's forces [N] on the nodes in a frame: the least inside the friction cones that bear the target's weight and
/// inertia.
Eigen::Matrix3Xd ground_forces(const physics::Scene& scene, const ContactSchedule& contacts, double length,
                               const physics::State& state, const Eigen::Matrix3Xd& acceleration, Eigen::Index f) {
  const physics::Body& body = scene.body;
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, body.node_count());
  const std::vector<ContactGenerator> generators =
      contact_generators(contacts, f, scene.ground.friction, PrepareOptions().support_friction);
  if (generators.empty()) return nodes;
  const int count = static_cast<int>(generators.size());
  const double weight = body.mass.sum() * scene.gravity.norm();
  const Eigen::Vector3d com = physics::centre_of_mass(body, state.x);
  Eigen::Matrix<double, 6, 1> wanted = Eigen::Matrix<double, 6, 1>::Zero();
  for (int i = 0; i < body.node_count(); ++i) {
    const Eigen::Vector3d force = body.mass[i] * (acceleration.col(i) - scene.gravity);
    wanted.head<3>() += force / weight;
    wanted.tail<3>() += (state.x.col(i) - com).cross(force) / (weight * length);
  }
  Eigen::MatrixXd given_by(6, count);
  for (int k = 0; k < count; ++k) {
    const ContactGenerator& generator = generators[static_cast<std::size_t>(k)];
    given_by.col(k).head<3>() = generator.force;
    given_by.col(k).tail<3>() = (scene.contact_points.of(state.x, generator.point) - com).cross(generator.force) / length;
  }
  const BoundedLeastSquares problem = held_nonnegative(kGroundBalance * given_by, kGroundBalance * wanted, 1);
  const Eigen::VectorXd given = solve(problem, Eigen::VectorXd::Constant(count, 1e-3)).x;
  for (int k = 0; k < count; ++k) {
    const ContactGenerator& generator = generators[static_cast<std::size_t>(k)];
    for (Eigen::Index c = 0; c < scene.contact_points.nodes.rows(); ++c) {
      nodes.col(scene.contact_points.nodes(c, generator.point)) +=
          scene.contact_points.weights(c, generator.point) * weight * given[k] * generator.force;
    }
  }
  return nodes;
}

/// The change of activations that takes most of the forces [N] that are left: conjugate gradients on the normal equations of the
/// nodes' misses, `rows` a metre through the factored system matrix, and of the effort. `b`: force per activation.
Eigen::VectorXd change_for(const Eigen::VectorXd& left, const Eigen::VectorXd& rows, physics::SystemMatrix& matrix,
                           const Eigen::SparseMatrix<double>& b) {
  const double effort = kEffort / static_cast<double>(b.cols());
  Eigen::MatrixXd column(rows.size(), 1);
  const auto miss_of = [&](const Eigen::VectorXd& force) -> Eigen::VectorXd {
    column = force;
    matrix.solve_in_place(column);
    return rows.cwiseProduct(column.col(0));
  };
  const auto back = [&](const Eigen::VectorXd& miss) -> Eigen::VectorXd {
    column = rows.cwiseProduct(miss);
    matrix.solve_in_place(column);
    return b.transpose() * column.col(0);
  };
  Eigen::VectorXd miss = -miss_of(left), change = Eigen::VectorXd::Zero(b.cols());
  Eigen::VectorXd slope = back(miss), way = slope;
  double steepness = slope.squaredNorm();
  const double enough = kLeastSlope * kLeastSlope * steepness;
  for (int round = 0; round < kRounds && steepness > enough; ++round) {
    const Eigen::VectorXd moved = miss_of(b * way);
    const double step = steepness / (moved.squaredNorm() + effort * way.squaredNorm());
    change += step * way;
    miss -= step * moved;
    slope = back(miss) - effort * change;
    const double before = steepness;
    steepness = slope.squaredNorm();
    way = slope + steepness / before * way;
  }
  return change;
}

}  // namespace

void bear_loads(const Performer& performer, Eigen::MatrixXd& activation) {
  const physics::Scene& scene = performer.scene;
  const physics::Body& body = scene.body;
  const Motion& target = performer.prepared.target;
  const Eigen::MatrixXd speeds = velocities(target), pulls = accelerations(target);
  physics::InternalForces<3> forces(body);
  physics::SystemMatrix matrix(body);
  const double square = kHorizon * kHorizon;
  Eigen::VectorXd rows(3 * body.node_count());  // W T^2
  for (int i = 0; i < body.node_count(); ++i)
    rows.segment<3>(3 * i).setConstant(square * std::sqrt(body.mass[i] / body.mass.sum()) / (kMissUnit * performer.length));
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const physics::State state{target.at(f), speeds.col(f).reshaped(3, body.node_count()), {}};
    const Eigen::Matrix3Xd acceleration = pulls.col(f).reshaped(3, body.node_count());
    forces.set_activation(activation.col(f));
    Eigen::Matrix3Xd left = ground_forces(scene, performer.prepared.contacts, performer.length, state, acceleration, f);
    forces.add_forces(state, left);
    for (int i = 0; i < body.node_count(); ++i) left.col(i) += body.mass[i] * (scene.gravity - acceleration.col(i));
    matrix.set_zero();
    matrix.add_mass(body, 1);
    matrix.add_damping(body, state.x, kHorizon);
    forces.add_stiffness(state.x, square, matrix);
    if (!matrix.factor()) continue;
    activation.col(f) += change_for(left.reshaped(), rows, matrix, forces.force_per_activation(state.x));
  }
}

}  // namespace hydrostat::retarget

#include "retarget/equilibrium.h"

#include "retarget/contact_loads.h"

namespace hydrostat::retarget {
namespace {

constexpr double kHoldTime = 1.0 / 120;  // [s] in which contact holds
constexpr double kPullTime = 0.1;        // [s] in which the plan draws back what nothing else holds
constexpr int kRounds = 8;

}  // namespace

Equilibrium::Equilibrium(const physics::Scene& scene, double length)
    : scene_(scene), hold_(contact_stiffness(scene, length, kHoldTime)), forces_(scene.body), matrix_(scene.body) {}

Eigen::Matrix3Xd Equilibrium::missing(const Eigen::Matrix3Xd& acceleration, const PlannedMoment& moment, const Eigen::Matrix3Xd& x) {
  forces_.set_activation(moment.activation);
  return missing_as_activated(acceleration, moment, x);
}

Eigen::Matrix3Xd Equilibrium::missing_as_activated(const Eigen::Matrix3Xd& acceleration, const PlannedMoment& moment,
                                                   const Eigen::Matrix3Xd& x) const {
  const physics::Body& body = scene_.body;
  const physics::ContactPoints& points = scene_.contact_points;
  Eigen::Matrix3Xd force = (scene_.gravity.replicate(1, x.cols()) - acceleration - (x - moment.state.x) / (kPullTime * kPullTime)) *
                           body.mass.asDiagonal();
  forces_.add_forces({x, moment.state.v}, force);
  for (int p = 0; p < points.count(); ++p) {
    if (moment.touching[static_cast<std::size_t>(p)] == ContactState::kOff) continue;
    const Eigen::Vector3d pull = hold_ * (points.of(moment.state.x, p) - points.of(x, p));
    for (int c = 0; c < points.nodes.rows(); ++c) force.col(points.nodes(c, p)) += points.weights(c, p) * pull;
  }
  return force;
}

void Equilibrium::settle(const Eigen::Matrix3Xd& acceleration, PlannedMoment& moment) {
  Eigen::Matrix3Xd x = moment.state.x, left = missing(acceleration, moment, x);
  const double before = left.norm();
  for (int round = 0; round < kRounds; ++round) {
    matrix_.set_zero();
    matrix_.add_mass(scene_.body, 1 / (kPullTime * kPullTime));
    forces_.add_stiffness(x, 1, matrix_);
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      if (moment.touching[static_cast<std::size_t>(p)] == ContactState::kOff) continue;
      matrix_.add_contact(scene_.contact_points, p, hold_ * Eigen::Matrix3d::Identity());
    }
    if (!matrix_.factor()) return;
    Eigen::MatrixXd step = left.reshaped();
    matrix_.solve_in_place(step);
    x += step.reshaped(3, x.cols());
    left = missing_as_activated(acceleration, moment, x);
  }
  if (left.norm() < before) moment.state.x = x;
}

}  // namespace hydrostat::retarget

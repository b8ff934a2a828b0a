#include "retarget/linear_step.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "retarget/contact_loads.h"
#include "retarget/dense_product.h"

namespace hydrostat::retarget {
namespace {

constexpr double kNudge = 1e-5;      // of L, over which forces are differentiated
constexpr double kLevelShare = 0.25; // of a wrong height that the ground takes away in a step
constexpr double kSoftest = 0.5;     // of a mode's mass that a step has to move at least, however much the mode buckles

Eigen::MatrixXd symmetric(const Eigen::MatrixXd& matrix) { return 0.5 * (matrix + matrix.transpose()); }

/// The matrix with its symmetric part raised to `least` where that is less.
Eigen::MatrixXd at_least(double least, const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric(matrix));
  const Eigen::VectorXd raise = (least - solver.eigenvalues().array()).cwiseMax(0);
  if (raise.isZero(0)) return matrix;
  return matrix + product(solver.eigenvectors() * raise.asDiagonal(), solver.eigenvectors().transpose());
}

}  // namespace

Eigen::VectorXd LinearStep::after(const Eigen::VectorXd& z, const Eigen::VectorXd& muscles) const {
  const Eigen::Index modes = drive.rows();
  Eigen::VectorXd result(2 * modes);
  result.tail(modes) = carry * z + drive * muscles;
  result.head(modes) = z.head(modes) + advance * result.tail(modes);
  return result;
}

LinearSteps::LinearSteps(const physics::Scene& scene, const Muscles& muscles, const ReducedModes& modes, double length, double step_s)
    : scene_(scene),
      muscles_(muscles),
      modes_(modes),
      length_(length),
      speed_unit_(std::sqrt(gravity_unit(scene) * length)),
      step_s_(step_s),
      contact_mass_(step_s * step_s * contact_stiffness(scene, length, step_s)),
      forces_(scene.body),
      dashpots_(scene.body) {}

/// Of places by central differences along the modes, so that every kind of force counts with all its terms.
LinearSteps::Derivatives LinearSteps::derivatives(const PlannedMoment& moment) {
  const Eigen::Index modes = modes_.count(), nodes = moment.state.x.cols();
  const auto force_at = [&](const Eigen::Matrix3Xd& x) {
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, nodes);
    forces_.add_forces({x, moment.state.v}, force);
    return force;
  };
  Eigen::MatrixXd by_place(3 * nodes, modes);
  for (Eigen::Index k = 0; k < modes; ++k) {
    const auto field = modes_.fields.col(k).reshaped(3, nodes);
    const double nudge = kNudge * length_ / field.cwiseAbs().maxCoeff();
    by_place.col(k) = (force_at(moment.state.x - nudge * field) - force_at(moment.state.x + nudge * field)).reshaped() / (2 * nudge);
  }
  dashpots_.set_zero();
  dashpots_.add_damping(scene_.body, moment.state.x, 1);
  const Eigen::MatrixXd by_speed = dashpots_.lower().selfadjointView<Eigen::Lower>() * modes_.fields;
  return {product_of_transposed(modes_.fields, by_place), symmetric(product_of_transposed(modes_.fields, by_speed))};
}

LinearSteps::Holds LinearSteps::holds(const PlannedMoment& moment) const {
  const Eigen::Index modes = modes_.count();
  struct Foot {
    Eigen::MatrixXd moves;  // 3 x R: the sum of its points'
    int points = 0;
    bool sticks = false;
  };
  std::map<int, Foot> feet;
  const physics::ContactPoints& points = scene_.contact_points;
  for (int p = 0; p < points.count(); ++p) {
    const ContactState touch = moment.touching[static_cast<std::size_t>(p)];
    if (touch == ContactState::kOff) continue;
    Foot& foot = feet[moment.patch[static_cast<std::size_t>(p)]];
    if (foot.points == 0) foot.moves.setZero(3, modes);
    ++foot.points;
    foot.sticks = touch == ContactState::kStick;
    for (int c = 0; c < points.nodes.rows(); ++c) foot.moves += points.weights(c, p) * modes_.fields.middleRows<3>(3 * points.nodes(c, p));
  }
  Holds result{Eigen::MatrixXd::Zero(modes, modes), Eigen::MatrixXd::Zero(modes, modes)};
  for (const auto& [patch, foot] : feet) {
    const Eigen::RowVectorXd rise = scene_.ground.normal.transpose() * foot.moves;
    const Eigen::MatrixXd level = rise.transpose() * rise / foot.points;
    result.level += level;
    result.stick += foot.sticks ? Eigen::MatrixXd(foot.moves.transpose() * foot.moves / foot.points) : level;
  }
  return result;
}

LinearStep LinearSteps::at(const PlannedMoment& moment) {
  forces_.set_activation(moment.activation);
  const auto [stiffness, damping] = derivatives(moment);
  const Eigen::Index modes = modes_.count();
  const double h = step_s_, per_second = speed_unit_ / length_;
  const Holds held = holds(moment);
  const Eigen::MatrixXd system =
      Eigen::MatrixXd::Identity(modes, modes) + h * damping + h * h * stiffness + contact_mass_ * held.stick;
  const Eigen::MatrixXd inverse = at_least(kSoftest, system).partialPivLu().inverse();
  LinearStep step;
  step.advance = h * per_second;
  step.carry.resize(modes, 2 * modes);
  step.carry.rightCols(modes) = inverse;
  step.carry.leftCols(modes) = product(inverse, h * stiffness + (kLevelShare * contact_mass_ / h) * held.level) / -per_second;
  const Eigen::MatrixXd push = product_of_transposed(modes_.fields, forces_.force_per_activation(moment.state.x) * muscles_.fields);
  step.drive = product(inverse, (h / speed_unit_) * push);
  return step;
}

}  // namespace hydrostat::retarget

#include "retarget/long_axis.h"

#include <algorithm>
#include <cmath>

#include "retarget/best_fit_rotation.h"

namespace hydrostat::retarget {

LongAxis long_axis(const physics::Body& body, const Motion& target) {
  const Eigen::VectorXd shares = body.mass / body.mass.sum();
  const RigidFit fit = best_rigid_fit(body.rest, target.at(0), shares);
  LongAxis axis;
  axis.arms = fit.rotation * (body.rest.colwise() - fit.mean_a);
  const double xx = axis.arms.row(0).cwiseAbs2() * shares, zz = axis.arms.row(2).cwiseAbs2() * shares;
  const double xz = axis.arms.row(0).cwiseProduct(axis.arms.row(2)) * shares, angle = 0.5 * std::atan2(2 * xz, xx - zz);
  axis.along = {std::cos(angle), 0, std::sin(angle)};
  const auto gyration = [&](const Eigen::Vector3d& direction) {
    return std::sqrt((direction.transpose() * axis.arms).cwiseAbs2() * shares);
  };
  const double across = std::max(gyration(axis.along.cross(Eigen::Vector3d::UnitY())), gyration(Eigen::Vector3d::UnitY()));
  axis.slenderness = gyration(axis.along) / std::max(across, 1e-300);
  return axis;
}

Eigen::MatrixX3d bends_across(const LongAxis& axis, const Eigen::Matrix2Xi& constraints) {
  Eigen::MatrixX3d bends(constraints.cols(), 3);
  for (Eigen::Index e = 0; e < constraints.cols(); ++e) {
    const Eigen::Vector3d from = axis.arms.col(constraints(0, e)), to = axis.arms.col(constraints(1, e));
    bends.row(e) = std::pow((to - from).normalized().dot(axis.along), 2) * (from + to);
  }
  return bends;
}

}  // namespace hydrostat::retarget

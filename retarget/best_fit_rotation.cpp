#include "retarget/best_fit_rotation.h"

#include <Eigen/SVD>
#include <cassert>
#include <cmath>

namespace hydrostat::retarget {
namespace {

/// The rotation R, never a reflection, with the largest trace of R times the covariance' (Kabsch 1976).
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& covariance) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs.z() = -1;
  Eigen::Matrix3d rotation;
  rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  return rotation;
}

}  // namespace

Eigen::Matrix3d best_fit_rotation(const Eigen::Ref<const Eigen::Matrix3Xd>& rest,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& positions,
                                  const Eigen::Ref<const Eigen::VectorXd>& mass) {
  assert(rest.cols() == positions.cols() && rest.cols() == mass.size());
  const Eigen::Vector3d rest_com = rest * mass / mass.sum();
  const Eigen::Matrix3d covariance = positions * mass.asDiagonal() * (rest.colwise() - rest_com).transpose();
  return rotation_of(covariance);
}

RigidFit best_rigid_fit(const physics::ConstPoints& a, const physics::ConstPoints& b, const Eigen::VectorXd& weights) {
  RigidFit fit;
  fit.mean_a = a * weights;
  fit.mean_b = b * weights;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const Eigen::Vector3d from = a.col(i) - fit.mean_a, to = b.col(i) - fit.mean_b;
    covariance += weights[i] * to * from.transpose();
  }
  fit.rotation = rotation_of(covariance);
  double squared = 0;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const Eigen::Vector3d from = a.col(i) - fit.mean_a, to = b.col(i) - fit.mean_b;
    squared += weights[i] * (fit.rotation * from - to).squaredNorm();
  }
  fit.rms = std::sqrt(squared);
  return fit;
}

std::vector<Eigen::Quaterniond> best_fit_rotations(const Eigen::Ref<const Eigen::Matrix3Xd>& rest, const Motion& motion,
                                                   const Eigen::Ref<const Eigen::VectorXd>& mass) {
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(static_cast<std::size_t>(motion.count()));
  Eigen::Quaterniond before = Eigen::Quaterniond::Identity();
  for (Eigen::Index f = 0; f < motion.count(); ++f) {
    Eigen::Quaterniond rotation(best_fit_rotation(rest, motion.at(f), mass));
    rotation.normalize();
    if (rotation.dot(before) < 0) rotation.coeffs() = -rotation.coeffs();
    rotations.push_back(rotation);
    before = rotation;
  }
  return rotations;
}

}  // namespace hydrostat::retarget

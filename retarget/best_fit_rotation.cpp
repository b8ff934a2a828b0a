#include "retarget/best_fit_rotation.h"

#include <Eigen/SVD>
#include <cassert>

namespace hydrostat::retarget {

Eigen::Matrix3d best_fit_rotation(const Eigen::Ref<const Eigen::Matrix3Xd>& rest,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& positions,
                                  const Eigen::Ref<const Eigen::VectorXd>& mass) {
  assert(rest.cols() == positions.cols() && rest.cols() == mass.size());
  const Eigen::Vector3d rest_com = rest * mass / mass.sum();
  const Eigen::Matrix3d covariance = positions * mass.asDiagonal() * (rest.colwise() - rest_com).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs.z() = -1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
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

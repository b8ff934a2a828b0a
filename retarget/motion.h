#pragma once

#include <Eigen/Core>

namespace hydrostat::retarget {

/// Positions of N points over F uniform frames: column f holds x0 y0 z0 x1 y1 z1 ... [m] of frame f.
/// A loop has one period and no repeated last frame; from one period to the next it moves on by `travel` and turns by `yaw`.
struct Motion {
  double rate_hz = 60;
  Eigen::MatrixXd frames;  // 3N x F
  bool loop = false;
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();  // [m] a period, horizontal
  double yaw = 0;  // [rad] a period, about y through the world's origin, before the travel is added

  Eigen::Index count() const { return frames.cols(); }
  double period_s() const { return static_cast<double>(frames.cols()) / rate_hz; }
  /// Positions of frame f as 3 x N.
  Eigen::Map<const Eigen::Matrix3Xd> at(Eigen::Index f) const {
    return {frames.data() + f * frames.rows(), 3, frames.rows() / 3};
  }
  Eigen::Map<Eigen::Matrix3Xd> at(Eigen::Index f) { return {frames.data() + f * frames.rows(), 3, frames.rows() / 3}; }
};

}  // namespace hydrostat::retarget

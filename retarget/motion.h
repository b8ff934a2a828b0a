#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace hydrostat::retarget {

/// Positions of N points over F uniform frames: column f holds x0 y0 z0 x1 y1 z1 ... [m] of frame f.
/// A loop has one period and no repeated last frame; from one period to the next it moves on by `travel` and turns by `yaw`.
struct Motion {
  double rate_hz = 60;
  Eigen::MatrixXd frames;      // 3N x F
  bool loop = false;
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();  // [m] a period, horizontal
  double yaw = 0;              // [rad] a period, about y through the world's origin, before the travel is added

  Eigen::Index count() const { return frames.cols(); }
  /// Of a loop: one period. Of a one-shot: first to last frame.
  double duration_s() const { return static_cast<double>(frames.cols() - (loop ? 0 : 1)) / rate_hz; }
  /// Positions of frame f as 3 x N.
  Eigen::Map<const Eigen::Matrix3Xd> at(Eigen::Index f) const {
    return {frames.data() + f * frames.rows(), 3, frames.rows() / 3};
  }
  Eigen::Map<Eigen::Matrix3Xd> at(Eigen::Index f) { return {frames.data() + f * frames.rows(), 3, frames.rows() / 3}; }
};

/// The frame that is on at a time [s] >= 0: loops go on for ever, one-shots hold their last.
Eigen::Index frame_at(const Motion& motion, double time_s);

/// Where the loop stands after `cycles` periods (may be negative), as a rigid move; identity for one-shots.
Eigen::Isometry3d after_cycles(const Motion& motion, long cycles);

/// The motion with `pad` more frames on both sides: the neighbouring periods of a loop, the odd reflection of a one-shot's
/// ends (positions and velocities go on, acceleration is zero there). Returns 3N x (F + 2 pad).
Eigen::MatrixXd padded_frames(const Motion& motion, int pad);

/// Which ends of a one-shot are at rest: it stands in its first frame before that, in its last behind it.
struct RestingEnds {
  bool first = false, last = false;
};

/// Central differences over the padded frames, 3N x F: [m/s] and [m/s2]. At a resting end the frame itself stands for those beyond it.
Eigen::MatrixXd velocities(const Motion& motion);
Eigen::MatrixXd accelerations(const Motion& motion, RestingEnds ends = {});

/// A motion at any time: loops go on for ever, one-shots hold their ends. Cubic Hermite between the frames with central
/// slopes, so positions are C1.
class MotionCurve {
 public:
  explicit MotionCurve(const Motion& motion);
  /// Positions [m] and velocities [m/s] 3 x N at time [s]; allocates nothing once the outputs have their size.
  void at(double time_s, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const;

 private:
  Motion motion_;
  Eigen::MatrixXd slopes_;  // 3N x F [m/s]
};

}  // namespace hydrostat::retarget

#include "retarget/motion.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

/// x of each frame moved rigidly; x is 3N x 1.
Eigen::VectorXd moved(const Eigen::Isometry3d& move, const Eigen::Ref<const Eigen::VectorXd>& x) {
  Eigen::VectorXd result(x.size());
  for (Eigen::Index i = 0; i < x.size(); i += 3) result.segment<3>(i) = move * Eigen::Vector3d(x.segment<3>(i));
  return result;
}

}  // namespace

Eigen::Index frame_at(const Motion& motion, double time_s) {
  const auto frame = static_cast<Eigen::Index>(time_s * motion.rate_hz);
  return motion.loop ? frame % motion.count() : std::min(frame, motion.count() - 1);
}

Eigen::Isometry3d after_cycles(const Motion& motion, long cycles) {
  Eigen::Isometry3d one = Eigen::Isometry3d::Identity();
  if (!motion.loop) return one;
  one.linear() = Eigen::AngleAxisd(motion.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  one.translation() = motion.travel;
  if (cycles < 0) one = one.inverse();
  Eigen::Isometry3d all = Eigen::Isometry3d::Identity();
  for (long k = 0; k < std::labs(cycles); ++k) all = one * all;
  return all;
}

Eigen::MatrixXd padded_frames(const Motion& motion, int pad) {
  const long count = motion.count();
  Eigen::MatrixXd padded(motion.frames.rows(), count + 2 * pad);
  padded.middleCols(pad, count) = motion.frames;
  for (long k = 1; k <= pad; ++k) {
    if (motion.loop) {
      const long before = (k + count - 1) / count, after = (count - 1 + k) / count;
      padded.col(pad - k) = moved(after_cycles(motion, -before), motion.frames.col(before * count - k));
      padded.col(pad + count - 1 + k) = moved(after_cycles(motion, after), motion.frames.col((count - 1 + k) - after * count));
    } else {
      const long inside = std::min(k, count - 1);
      padded.col(pad - k) = 2 * motion.frames.col(0) - motion.frames.col(inside);
      padded.col(pad + count - 1 + k) = 2 * motion.frames.col(count - 1) - motion.frames.col(count - 1 - inside);
    }
  }
  return padded;
}

Eigen::MatrixXd velocities(const Motion& motion) {
  const Eigen::MatrixXd padded = padded_frames(motion, 1);
  const Eigen::Index count = motion.count();
  return (padded.rightCols(count) - padded.leftCols(count)) * (0.5 * motion.rate_hz);
}

Eigen::MatrixXd accelerations(const Motion& motion, RestingEnds ends) {
  Eigen::MatrixXd padded = padded_frames(motion, 1);
  const Eigen::Index count = motion.count();
  if (!motion.loop && ends.first) padded.col(0) = motion.frames.col(0);
  if (!motion.loop && ends.last) padded.col(count + 1) = motion.frames.col(count - 1);
  return (padded.rightCols(count) - 2 * padded.middleCols(1, count) + padded.leftCols(count)) *
         (motion.rate_hz * motion.rate_hz);
}

MotionCurve::MotionCurve(const Motion& motion) : motion_(motion), slopes_(velocities(motion)) {
  if (!motion.loop) {  // it starts and ends at rest
    slopes_.col(0).setZero();
    slopes_.col(slopes_.cols() - 1).setZero();
  }
}

void MotionCurve::at(double time_s, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const {
  const long count = motion_.count();
  const double frame = time_s * motion_.rate_hz;
  long first = static_cast<long>(std::floor(frame));
  double s = frame - static_cast<double>(first);
  if (!motion_.loop) {
    if (first < 0) first = 0, s = 0;
    if (first >= count - 1) first = std::max(0L, count - 2), s = 1;
  }
  const long first_cycle = motion_.loop ? static_cast<long>(std::floor(static_cast<double>(first) / static_cast<double>(count))) : 0;
  const long next = motion_.loop ? first + 1 : std::min(first + 1, count - 1);
  const long next_cycle = motion_.loop ? static_cast<long>(std::floor(static_cast<double>(next) / static_cast<double>(count))) : 0;
  const Eigen::Isometry3d a = after_cycles(motion_, first_cycle), b = after_cycles(motion_, next_cycle);
  const double h = 1 / motion_.rate_hz;
  const double h00 = (1 + 2 * s) * (1 - s) * (1 - s), h10 = s * (1 - s) * (1 - s), h01 = s * s * (3 - 2 * s), h11 = s * s * (s - 1);
  const double d00 = 6 * s * (s - 1), d10 = (1 - s) * (1 - 3 * s), d11 = s * (3 * s - 2);
  const Eigen::Index p = first - first_cycle * count, q = next - next_cycle * count, nodes = motion_.frames.rows() / 3;
  x.resize(3, nodes);
  v.resize(3, nodes);
  const bool held = !motion_.loop && (frame <= 0 || frame >= static_cast<double>(count - 1));
  for (Eigen::Index i = 0; i < nodes; ++i) {
    const Eigen::Vector3d x0 = a * Eigen::Vector3d(motion_.frames.col(p).segment<3>(3 * i));
    const Eigen::Vector3d x1 = b * Eigen::Vector3d(motion_.frames.col(q).segment<3>(3 * i));
    const Eigen::Vector3d m0 = a.linear() * slopes_.col(p).segment<3>(3 * i);
    const Eigen::Vector3d m1 = b.linear() * slopes_.col(q).segment<3>(3 * i);
    x.col(i) = h00 * x0 + h01 * x1 + h * (h10 * m0 + h11 * m1);
    if (held) {
      v.col(i).setZero();
    } else {
      v.col(i) = d00 / h * (x0 - x1) + d10 * m0 + d11 * m1;
    }
  }
}

}  // namespace hydrostat::retarget

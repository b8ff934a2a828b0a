#include "retarget/root_motion.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {

RootMotionResult recover_root_motion(const Motion& points, double length, RootMotion mode) {
  const Eigen::Index frames = points.count(), count = points.frames.rows() / 3;
  RootMotionResult result;
  result.offset = Eigen::MatrixXd::Zero(3, frames);
  if (mode == RootMotion::kKeep) return result;
  if (mode == RootMotion::kNone) {
    Eigen::Vector3d travel = points.travel;
    if (!points.loop) travel = (points.at(frames - 1) - points.at(0)).rowwise().mean();
    travel.y() = 0;
    const double steps = static_cast<double>(points.loop ? frames : std::max<Eigen::Index>(1, frames - 1));
    for (Eigen::Index f = 0; f < frames; ++f) result.offset.col(f) = -travel * (static_cast<double>(f) / steps);
    if (points.loop) result.travel = -travel;
    return result;
  }
  if (mode == RootMotion::kAuto && (!points.loop || points.travel.norm() > 0.05 * length)) return result;

  // The speed of the ground under the body: the mean over the low points, the lowest counting most.
  const Eigen::MatrixXd speed = velocities(points);
  const double soft = 0.01 * length;
  Eigen::MatrixXd ground(2, frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const auto x = points.at(f);
    const double lowest = x.row(1).minCoeff();
    double weights = 0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (Eigen::Index p = 0; p < count; ++p) {
      const double height = (x(1, p) - lowest) / soft;
      if (height > 4) continue;
      const double weight = std::exp(-height * height);
      sum += weight * Eigen::Vector2d(speed(3 * p, f), speed(3 * p + 2, f));
      weights += weight;
    }
    ground.col(f) = sum / weights;
  }
  const double period = points.duration_s();
  const Eigen::Vector2d mean = ground.rowwise().mean();
  if (mode == RootMotion::kAuto && mean.norm() * period < 0.1 * length) return result;
  if (points.loop) {
    // A steady pace with its first harmonic: what remains is the feet's own sliding, which the foot lock takes.
    const double pace = mean.norm();
    double cosine = 0, sine = 0;
    const auto phase_of = [&](Eigen::Index f) { return 2 * M_PI * static_cast<double>(f) / static_cast<double>(frames); };
    const auto along = [&](Eigen::Index f) { return pace > 0 ? (mean.x() * ground(0, f) + mean.y() * ground(1, f)) / pace : 0; };
    for (Eigen::Index f = 0; f < frames; ++f) {
      cosine += along(f) * std::cos(phase_of(f)) * 2 / static_cast<double>(frames);
      sine += along(f) * std::sin(phase_of(f)) * 2 / static_cast<double>(frames);
    }
    for (Eigen::Index f = 0; f < frames; ++f) {
      const double change = pace > 0 ? (cosine * std::cos(phase_of(f)) + sine * std::sin(phase_of(f))) / pace : 0;
      ground(0, f) = mean.x() * (1 + change);
      ground(1, f) = mean.y() * (1 + change);
    }
  }
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (Eigen::Index f = 0; f < frames; ++f) {
    result.offset.col(f) = place;
    place.x() -= ground(0, f) / points.rate_hz;
    place.z() -= ground(1, f) / points.rate_hz;
  }
  result.travel = points.loop ? place : Eigen::Vector3d::Zero();
  result.recovered = true;
  return result;
}

}  // namespace hydrostat::retarget

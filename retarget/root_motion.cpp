#include "retarget/root_motion.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "retarget/leap_pace.h"
#include "retarget/mirror.h"

namespace hydrostat::retarget {
namespace {

constexpr int kHarmonics = 2;        // of the pace in a period: one for the stride, one for its steps
constexpr double kEvenness = 0.003;  // weight of an even pace against one frame on the ground

/// How far a frame is on the ground by the height of its lowest point [m], 1 to 0; `soft` [m] counts half.
Eigen::VectorXd bearing_of(const Eigen::VectorXd& heights, double soft) {
  std::vector<double> sorted(heights.data(), heights.data() + heights.size());
  const Eigen::Index fifth = heights.size() / 5;
  std::nth_element(sorted.begin(), sorted.begin() + fifth, sorted.end());
  const Eigen::ArrayXd above = (heights.array() - sorted[static_cast<std::size_t>(fifth)]).max(0) / soft;
  return (1 + above.square()).inverse();
}

/// The course of a loop's pace, 2 x F [m/s]: the mean and the first harmonics that fit best where something is near the ground.
/// What remains is the feet's own sliding, which the foot lock takes. `weights` F say how much of each frame is on the ground.
Eigen::MatrixXd smooth_pace(const Eigen::MatrixXd& ground, const Eigen::VectorXd& weights) {
  const Eigen::Index frames = ground.cols();
  Eigen::MatrixXd basis(frames, 1 + 2 * kHarmonics);
  for (Eigen::Index f = 0; f < frames; ++f) {
    basis(f, 0) = 1;
    for (int k = 1; k <= kHarmonics; ++k) {
      const double phase = 2 * M_PI * k * static_cast<double>(f) / static_cast<double>(frames);
      basis(f, 2 * k - 1) = std::cos(phase);
      basis(f, 2 * k) = std::sin(phase);
    }
  }
  Eigen::MatrixXd normal = basis.transpose() * weights.asDiagonal() * basis;
  for (int k = 1; k <= kHarmonics; ++k) {
    normal(2 * k - 1, 2 * k - 1) += kEvenness * k * k * static_cast<double>(frames);
    normal(2 * k, 2 * k) += kEvenness * k * k * static_cast<double>(frames);
  }
  const Eigen::MatrixXd fit = normal.ldlt().solve(basis.transpose() * weights.asDiagonal() * ground.transpose());
  return (basis * fit).transpose();
}

}  // namespace

RootMotionResult recover_root_motion(const Motion& points, const Motion& com, double length, RootMotion mode) {
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
  Eigen::VectorXd heights(frames);
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
    heights[f] = lowest;
  }
  const Eigen::VectorXd bearing = bearing_of(heights, soft);
  const bool leaping = points.loop && leaps(bearing, com);
  if (leaping) {
    ground = leaping_pace(ground, bearing, com, length);
    // Else the way leans to the side whose points are a little lower.
    if (const std::optional<int> across = mirror_axis(points, length)) ground.row(*across / 2).setZero();
  }
  const Eigen::Vector2d mean = ground.rowwise().mean();
  if (mode == RootMotion::kAuto && mean.norm() * points.duration_s() < 0.1 * length) return result;
  if (points.loop && !leaping) ground = smooth_pace(ground, bearing);
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

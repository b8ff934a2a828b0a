#include "retarget/stride_feedback.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kMost = 0.1;          // change of the swing
constexpr double kLeastStride = 0.02;  // of L
constexpr int kSamples = 64;           // of a period

Eigen::Vector3d level(const Eigen::Vector3d& v) { return {v.x(), 0, v.z()}; }

}  // namespace

StrideFeedback::StrideFeedback(const PreparedTarget& plan, double length, Eigen::Index constraints,
                               const std::function<void(double, Eigen::VectorXd&)>& feed_forward) {
  if (!plan.target.loop || !is_dragged(plan.contacts)) return;
  cycle_ = after_cycles(plan.target, 1);
  period_s_ = plan.target.duration_s();
  if (level(cycle_.translation()).norm() < kLeastStride * length) return;
  mean_.setZero(constraints);
  Eigen::VectorXd sample = mean_;
  for (int k = 0; k < kSamples; ++k) {
    feed_forward(period_s_ * k / kSamples, sample);
    mean_ += sample / kSamples;
  }
}

void StrideFeedback::follow(const Eigen::Vector3d& target, const Eigen::Vector3d& body, double seconds) {
  if (!is_needed()) return;
  const Eigen::Vector3d stride = level(cycle_ * target - target);
  const double lag = level(target - body).dot(stride) / stride.squaredNorm();
  gain_ += (std::clamp(lag, -kMost, kMost) - gain_) * (1 - std::exp(-2 * seconds / period_s_));
}

void StrideFeedback::apply(Eigen::VectorXd& activation) const {
  if (gain_ != 0) activation += gain_ * (activation - mean_);
}

}  // namespace hydrostat::retarget

#include "retarget/stride_feedback.h"

#include <algorithm>
#include <cmath>

#include "retarget/reference_glide.h"

namespace hydrostat::retarget {
namespace {

constexpr double kMostChange = 0.1;    // change of the swing; activation by which a body steers
constexpr double kNoStride = 0.02;     // of L
constexpr double kLeastStretch = 0.5;  // of a stride: what stretches less does not travel by it
constexpr int kPhases = 64;            // of a period
constexpr double kStridesAhead = 4;    // within which the path is met again
constexpr double kMostHeading = 0.2;   // [rad], towards the path
// Bend by error of heading. Ends that stick would turn the body by the whole bend in a cycle; a soft body on ends that
// slip turns by a twentieth (worm), so that this closes an error in about a cycle.
constexpr double kBendPerTurn = 20;
constexpr double kMostBend = 0.3;      // [rad]; a body that is bent further tips over its own arch
// Share of the bend that is left below which strides grow less, to none where all is used: on fine meshes a worm's longer strides
// turn the bend's effect round (320 nodes, bend at its limit: 0.02 degrees a cycle off its heading, with strides a tenth longer 0.56).
constexpr double kSpareBend = 0.25;

Eigen::Vector3d level(const Eigen::Vector3d& v) { return {v.x(), 0, v.z()}; }

}  // namespace

StrideFeedback::StrideFeedback(const PreparedTarget& plan, double length, const Eigen::Matrix2Xi& constraints,
                               const std::function<void(double, Eigen::VectorXd&)>& feed_forward) {
  if (!plan.target.loop || !is_dragged(plan.contacts)) return;
  cycle_ = after_cycles(plan.target, 1);
  period_s_ = plan.target.duration_s();
  const Eigen::Vector3d centre = plan.target.at(0).rowwise().mean(), stride = level(cycle_ * centre - centre);
  if (stride.norm() < kNoStride * length) return;
  mean_.setZero(constraints.cols());
  Eigen::VectorXd sample = mean_;
  for (int k = 0; k < kPhases; ++k) {
    feed_forward(period_s_ * k / kPhases, sample);
    mean_ += sample / kPhases;
  }
  learn_to_steer(plan.target, stride, constraints);
}

void StrideFeedback::learn_to_steer(const Motion& target, const Eigen::Vector3d& stride, const Eigen::Matrix2Xi& constraints) {
  const Eigen::Vector3d way = stride.normalized(), right = way.cross(Eigen::Vector3d::UnitY());
  stretch_.resize(target.count());
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const Eigen::VectorXd along = target.at(f).transpose() * way;
    stretch_[f] = along.maxCoeff() - along.minCoeff();
  }
  const double longest = stretch_.maxCoeff(), shortest = stretch_.minCoeff(), middle = (longest + shortest) / 2;
  if (longest - shortest < kLeastStretch * stride.norm()) return;
  stretch_ = (stretch_.array() - middle) / ((longest - shortest) / 2);
  const Eigen::Vector3d centre = target.at(0).rowwise().mean();
  bend_.resize(constraints.cols());
  for (Eigen::Index e = 0; e < constraints.cols(); ++e) {
    const Eigen::Vector3d from = target.at(0).col(constraints(0, e)), to = target.at(0).col(constraints(1, e));
    bend_[e] = right.dot((from + to) / 2 - centre) * std::pow((to - from).normalized().dot(way), 2) / middle;
  }
  most_steering_ = std::min(kMostChange / bend_.cwiseAbs().maxCoeff(), kMostBend);
}

void StrideFeedback::follow(const RigidFit& fit, double seconds) {
  if (!is_needed()) return;
  const Eigen::Vector3d stride = level(cycle_ * fit.mean_a - fit.mean_a), way = stride.normalized();
  const Eigen::Vector3d off = level(fit.mean_b - fit.mean_a);
  const double smoothing = 1 - std::exp(-2 * seconds / period_s_);
  const double spare = steers() ? 1 - std::abs(steering_) / most_steering_ : 1;
  const double most = kMostChange * std::min(spare / kSpareBend, 1.0);
  gain_ += (std::clamp(-off.dot(way) / stride.norm(), -most, most) - gain_) * smoothing;
  // Turns about y: what lies to the left is met by a turn to the right.
  const double left = off.dot(Eigen::Vector3d::UnitY().cross(way));
  const double heading = std::clamp(-left / (kStridesAhead * stride.norm()), -kMostHeading, kMostHeading);
  const double turn = std::remainder(heading - yaw_of(fit.rotation), 2 * M_PI);
  steering_ += (std::clamp(kBendPerTurn * turn, -most_steering_, most_steering_) - steering_) * smoothing;
}

double StrideFeedback::stretch_at(double time_s) const {
  const double frames = static_cast<double>(stretch_.size());
  const double place = (time_s / period_s_ - std::floor(time_s / period_s_)) * frames;
  const Eigen::Index f = std::min(static_cast<Eigen::Index>(place), stretch_.size() - 1);
  return stretch_[f] + (place - static_cast<double>(f)) * (stretch_[(f + 1) % stretch_.size()] - stretch_[f]);
}

void StrideFeedback::apply(double time_s, Eigen::VectorXd& activation) const {
  if (gain_ != 0) activation += gain_ * (activation - mean_);
  if (steers() && steering_ != 0) activation += (0.5 * stretch_at(time_s) * steering_) * bend_;
}

}  // namespace hydrostat::retarget

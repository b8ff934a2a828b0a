#include "retarget/return_map.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "retarget/leaps.h"
#include "retarget/long_axis.h"
#include "retarget/reference_glide.h"

namespace hydrostat::retarget {
namespace {

constexpr int kCyclesAhead = 4;           // over which errors count
constexpr double kTrial = 0.005;          // activation of a handle while a model is asked; four times that answers four times
constexpr double kMostHandle = 0.03;      // activation of a handle
constexpr double kEffort = 0.6;           // per activation of a handle, where errors count per L
constexpr double kChange = 1;             // the same of how it changes from cycle to cycle: calms those that are hardly answered
constexpr double kLeastDrift = 0.003;     // per L, a cycle: less is left alone
constexpr double kLeastOnLegs = 0.015;    // the same of what steps freely, for its corrector holds the way but on slopes
constexpr double kThrown = 0.15;          // the same: what goes further astray falls or was pushed, and bends do not bring it back
constexpr double kNews = 0.5;             // share of what a cycle did beyond what was foreseen that counts as drift
constexpr double kSurprise = 0.05;        // per L, of a cycle beyond what was foreseen: a push, or a response that does not hold
constexpr double kSurpriseOfLeap = 0.15;  // of a stride, where that is more: a leap's heading shows where it lands
constexpr double kHolds = 0.5;            // of what the handles were to do, where that is more: what holds by half steers
constexpr double kForeseen = 0.5;         // of what would be a surprise: less is as foreseen
constexpr double kRegrowth = 1.2;         // factor by which the handles' bound grows again after a cycle as foreseen
constexpr double kAstray = 0.3;           // per L, of a model's cycle

/// An error of the way in lengths per L: a turn counts by how far it takes the ends of a body of length L.
Eigen::Vector3d per_length(const WayError& error, double length) {
  return {0.5 * error[0], error[1] / length, error[2] / length};
}

/// Activations that make the body longer on its right than on its left, and those that do so in front and the opposite
/// behind; up to 1, E x 2. Front is one end of the longest axis on the ground of the rest shape, as it lies in the target's
/// first frame.
Eigen::MatrixXd sideways_bends(const physics::Body& body, const Motion& target) {
  const LongAxis axis = long_axis(body, target);
  const Eigen::VectorXd right = bends_across(axis, body.edges) * axis.along.cross(Eigen::Vector3d::UnitY());
  Eigen::MatrixXd bends(body.edge_count(), 2);
  for (int e = 0; e < body.edge_count(); ++e) {
    const double place = axis.along.dot(axis.arms.col(body.edges(0, e)) + axis.arms.col(body.edges(1, e)));
    bends.row(e) << right[e], right[e] * place;
  }
  for (auto bend : bends.colwise()) bend /= std::max(bend.cwiseAbs().maxCoeff(), 1e-300);
  return bends;
}

/// Of the handles of one bend, at a phase in [0, 1): a swell, and what it is with the first harmonic.
Eigen::Vector3d courses(double phase) {
  const double angle = 2 * M_PI * phase, swell = 0.5 * (1 - std::cos(angle));
  return {swell, swell * std::cos(angle), swell * std::sin(angle)};
}

/// All of an error but what lies along the way: how far a leap carries is decided where it pushes off, and bends that were to change it
/// would only turn the body.
Eigen::Matrix3d without_way(const Eigen::Vector3d& stride) {
  const Eigen::Vector3d way(0, stride.x(), stride.z());
  if (way.isZero(0)) return Eigen::Matrix3d::Identity();
  return Eigen::Matrix3d::Identity() - way * way.transpose() / way.squaredNorm();
}

/// The h of least h' normal h / 2 + pull' h without an entry beyond most, by coordinate descent, which converges for a positive definite
/// normal. To shrink the best h of all to the bound instead would idle strong handles where weak ones would do it, had they no bound.
ReturnMap::Handles least_within(const Eigen::MatrixXd& normal, const Eigen::VectorXd& pull, double most) {
  constexpr int kSweeps = 20000;
  ReturnMap::Handles h = ReturnMap::Handles::Zero(), before;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    before = h;
    for (int k = 0; k < ReturnMap::kHandles; ++k)
      h[k] = std::clamp(h[k] - (normal.row(k).dot(h) + pull[k]) / normal(k, k), -most, most);
    if ((h - before).cwiseAbs().maxCoeff() <= 1e-12 * most) break;
  }
  return h;
}

Eigen::Matrix3d turned(double yaw) { return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix(); }

}  // namespace

ReturnMap::ReturnMap(const PreparedTarget& plan, double length, const physics::Body& body)
    : length_(length),
      period_s_(plan.target.duration_s()),
      yaw_(plan.target.yaw),
      is_dragged_(is_dragged(plan.contacts)),
      least_drift_(is_dragged_ ? kLeastDrift : kLeastOnLegs),
      most_(kMostHandle),
      least_surprise_(kSurprise),
      is_loop_(plan.target.loop) {
  response_.setZero();
  if (!is_loop_) return;
  bends_ = sideways_bends(body, plan.target);
  const Eigen::Vector3d centre = plan.target.at(0).rowwise().mean(), stride = after_cycles(plan.target, 1) * centre - centre;
  const Eigen::Matrix3d back = turned(-yaw_);
  const Eigen::Vector3d aside = back * Eigen::Vector3d::UnitY().cross(stride);  // by a heading of 1 rad
  if (has_flight(plan)) {
    least_surprise_ = std::max(kSurprise, kSurpriseOfLeap * stride.norm() / length_);
    counted_ = without_way(stride);
  }
  onward_ << 1, 0, 0, aside.x(), back(0, 0), back(0, 2), aside.z(), back(2, 0), back(2, 2);
}

WayError ReturnMap::way_error(const RigidFit& fit, long cycles) const {
  const Eigen::Vector3d off = turned(-yaw_ * static_cast<double>(cycles)) * (fit.mean_b - fit.mean_a);
  return {yaw_of(fit.rotation), off.x(), off.z()};
}

void ReturnMap::end_cycle(const WayError& error) {
  if (!is_loop_) return;
  const WayError effect = response_ * handles_, news = error - (onward_ * error_ + drift_ + effect);
  const double allowed = std::max(least_surprise_, kHolds * per_length(effect, length_).norm());
  const double surprise = per_length(news, length_).norm();
  error_ = error;
  if (!has_learned_) {
    is_drifting_ = surprise > least_drift_ && surprise < kThrown;
  } else if (surprise > allowed) {
    handles_.setZero();
    most_ /= 2;
  } else {
    if (!handles_.isZero(0) && surprise < kForeseen * allowed) most_ = std::min(kRegrowth * most_, kMostHandle);
    drift_ += kNews * news;
    steer();
  }
}

ReturnMap::Handles ReturnMap::trial(int k) {
  Handles handles = Handles::Zero();
  if (k > 0) handles[k - 1] = kTrial;
  return handles;
}

void ReturnMap::learn(const Answers& errors) {
  was_tried_ = true;
  for (const auto error : errors.colwise()) {
    if (!(per_length(error, length_).norm() < kAstray)) return;
  }
  const WayError by_itself = errors.col(1), drift = by_itself - onward_ * errors.col(0);
  if (!is_dragged_ && per_length(drift, length_).norm() < least_drift_) return;  // the body has been pushed
  response_ = (errors.rightCols<kHandles>().colwise() - by_itself) / kTrial;
  drift_ = drift;
  has_learned_ = true;
  steer();
}

/// If nothing drifts after the next cycle, these handles leave the least error over the cycles ahead.
void ReturnMap::steer() {
  Eigen::Matrix<double, 3, kHandles> reach = response_;
  WayError left = onward_ * error_ + drift_;
  Eigen::MatrixXd normal = (kEffort * kEffort + kChange * kChange) * Eigen::MatrixXd::Identity(kHandles, kHandles);
  Eigen::VectorXd pull = -kChange * kChange * handles_;
  for (int k = 0; k < kCyclesAhead; ++k) {
    Eigen::Matrix<double, 3, kHandles> rows;
    for (int h = 0; h < kHandles; ++h) rows.col(h) = counted_ * per_length(reach.col(h), length_);
    normal += rows.transpose() * rows;
    pull += rows.transpose() * counted_ * per_length(left, length_);
    reach = onward_ * reach;
    left = onward_ * left;
  }
  handles_ = least_within(normal, pull, most_);
}

void ReturnMap::apply(double time_s, Eigen::VectorXd& activation) const {
  if (handles_.isZero(0)) return;
  const double cycle = time_s / period_s_;
  const Eigen::Vector2d bend = handles_.reshaped(3, 2).transpose() * courses(cycle - std::floor(cycle));
  activation += bends_ * bend;
}

}  // namespace hydrostat::retarget

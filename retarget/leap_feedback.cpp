#include "retarget/leap_feedback.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "retarget/leaps.h"

namespace hydrostat::retarget {
namespace {

constexpr double kPushOff = 0.1;                    // [s] before a flight
constexpr double kAlong = 2, kAside = 0.4;          // [1/s] of an error of place
constexpr double kMostAlong = 1, kMostAside = 0.5;  // [1/s] of L
constexpr double kTurn = 5, kMostTurn = 3;          // [1/s] of an error of heading, [rad/s]
constexpr double kUpright = 0.2;                     // of the usual weight
constexpr double kLeastStride = 0.02;               // of L: less is no way

Eigen::Vector3d at_most(const Eigen::Vector3d& v, double most) { return v * (most / std::max(v.norm(), most)); }

}  // namespace

LeapFeedback::LeapFeedback(const PreparedTarget& plan, double length)
    : length_(length), period_s_(plan.target.duration_s()), rate_hz_(plan.target.rate_hz), yaw_(plan.target.yaw) {
  if (!plan.target.loop || !has_flight(plan)) return;
  const std::vector<bool> flying = frames_in_flight(plan.contacts, rate_hz_, true);
  const std::size_t frames = flying.size();
  pushes_off_.assign(frames, false);
  for (std::size_t f = 0; f < frames; ++f) {
    if (flying[f]) continue;
    for (long d = 1; d <= std::lround(kPushOff * rate_hz_); ++d) {
      if (flying[(f + static_cast<std::size_t>(d)) % frames]) pushes_off_[f] = true;
    }
  }
  const Eigen::Vector3d centre = plan.target.at(0).rowwise().mean();
  Eigen::Vector3d stride = after_cycles(plan.target, 1) * centre - centre;
  stride.y() = 0;
  if (stride.norm() > kLeastStride * length) way_ = stride.normalized();
}

void LeapFeedback::end_cycle(const WayError& error) {
  const Eigen::Vector3d place(error[1], 0, error[2]);
  const Eigen::Vector3d along = way_.dot(place) * way_;
  lead_ = -at_most(kAlong * along, kMostAlong * length_) - at_most(kAside * (place - along), kMostAside * length_);
}

double LeapFeedback::cycle_at(double time_s) const { return std::floor(time_s / period_s_ + 1e-9); }

bool LeapFeedback::pushes_off(double time_s) const {
  if (!is_needed()) return false;
  const auto frame = static_cast<std::size_t>(std::max(0.0, (time_s - cycle_at(time_s) * period_s_) * rate_hz_ + 1e-6));
  return pushes_off_[std::min(frame, pushes_off_.size() - 1)];
}

double LeapFeedback::upright(double time_s) const { return pushes_off(time_s) ? kUpright : 1; }

void LeapFeedback::apply(double time_s, double yaw, double turn, const Eigen::Vector3d& com, physics::State& reference) const {
  if (!pushes_off(time_s)) return;
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY(), lead = Eigen::AngleAxisd(yaw + cycle_at(time_s) * yaw_, up) * lead_;
  const Eigen::Vector3d spin = std::clamp(-kTurn * turn, -kMostTurn, kMostTurn) * up;
  for (Eigen::Index i = 0; i < reference.v.cols(); ++i) reference.v.col(i) += lead + spin.cross(reference.x.col(i) - com);
}

}  // namespace hydrostat::retarget

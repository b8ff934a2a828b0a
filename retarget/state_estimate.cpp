#include "retarget/state_estimate.h"

#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kManoeuvre = 0.1;  // of gravity: RMS of a deviation's acceleration

}  // namespace

StateEstimate::StateEstimate(const Observation& observation, double control_s, double gravity)
    : control_s_(control_s), ahead_s_(static_cast<double>(std::lround(observation.delay_s / control_s)) * control_s) {
  const double manoeuvre = kManoeuvre * gravity;
  if (observation.noise_m == 0 || manoeuvre == 0) return;
  const double index = manoeuvre * control_s * control_s / observation.noise_m;
  const double r = (4 + index - std::sqrt(8 * index + index * index)) / 4;
  place_gain_ = 1 - r * r;
  speed_gain_ = 2 * (2 - place_gain_) - 4 * std::sqrt(1 - place_gain_);
}

const physics::State& StateEstimate::next(const physics::State& seen, const physics::State& path_then,
                                          const physics::State& path_now) {
  if (place_gain_ == 1) {
    place_ = seen.x - path_then.x;
    speed_ = seen.v - path_then.v;
  } else if (is_first_) {
    place_ = place_gain_ * (seen.x - path_then.x);
    speed_.setZero(3, seen.x.cols());
  } else {
    place_ += control_s_ * speed_;
    const Eigen::Matrix3Xd surprise = seen.x - path_then.x - place_;
    place_ += place_gain_ * surprise;
    speed_ += (speed_gain_ / control_s_) * surprise;
  }
  is_first_ = false;
  estimate_.x = path_now.x + place_ + ahead_s_ * speed_;
  estimate_.v = path_now.v + speed_;
  return estimate_;
}

}  // namespace hydrostat::retarget

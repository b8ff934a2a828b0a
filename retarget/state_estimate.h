#pragma once

#include "retarget/observer.h"

namespace hydrostat::retarget {

/// Where the body is now, by what is seen of it and by the nominal path. Of what is late the deviation from the path is carried on at
/// its own speed; what is seen with noise is filtered as such a deviation, node by node, so that the path itself passes
/// undamped and without lag: place and speed by an alpha-beta filter whose gains are those of the steady Kalman filter for
/// deviations that change their speed as kManoeuvre says. What is seen at once and for sure is taken as it is.
/// Source: Kalata, "The Tracking Index", IEEE Transactions on Aerospace and Electronic Systems 20(2), 1984, eq. (20) to (23).
class StateEstimate {
 public:
  /// gravity [m/s2] is the measure of how fast deviations change.
  StateEstimate(const Observation& observation, double control_s, double gravity);

  /// `seen` of the body, once a control step; the nominal path at the time that is seen, and now.
  const physics::State& next(const physics::State& seen, const physics::State& path_then, const physics::State& path_now);
  /// Share of what was not foreseen that the place makes its own in a step, in (0, 1].
  double gain() const { return place_gain_; }

 private:
  double control_s_, ahead_s_, place_gain_ = 1, speed_gain_ = 0;
  bool is_first_ = true;
  Eigen::Matrix3Xd place_, speed_;  // of the deviation, when it was seen
  physics::State estimate_;
};

}  // namespace hydrostat::retarget

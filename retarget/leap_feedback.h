#pragma once

#include <vector>

#include "physics/stepper.h"
#include "retarget/prepare.h"
#include "retarget/return_map.h"

namespace hydrostat::retarget {

/// Feedback for a loop that leaps. Where a leap ends is settled by the velocity with which it begins, so that what a body is
/// off its place at the end of a cycle leads the velocity of the reference while the next push-off lasts: it leaps a little farther, or
/// a little to the side. Likewise what it is turned from its way now: it leaps to where it heads.
///
/// Pitch and roll are hardly corrected meanwhile. Muscles that push harder on one side let its foot go at another moment, and a foot that
/// drags for a hundredth of a second turns the body more than they did; what is left is made up for in the stance.
/// Source: Raibert, "Legged Robots That Balance", 1986, where the stance before a hop settles its way; window, gains and bounds are
/// ours, from trials with one frog.
class LeapFeedback {
 public:
  /// length [m] is L. What is played once, or never flies, it leaves alone.
  LeapFeedback(const PreparedTarget& plan, double length);

  bool is_needed() const { return !pushes_off_.empty(); }
  /// `error` at the end of a cycle, as ReturnMap::way_error has it.
  void end_cycle(const WayError& error);
  /// Changes the velocities of the reference of a time [s], whose centre of mass is `com` [m] and which was turned by `yaw` [rad] from the
  /// target; the body is turned by `turn` [rad] from the target, both about y.
  void apply(double time_s, double yaw, double turn, const Eigen::Vector3d& com, physics::State& reference) const;
  /// The weight of the rows of pitch and roll at a time [s] (ContactNow::upright).
  double upright(double time_s) const;
  const Eigen::Vector3d& lead() const { return lead_; }  // [m/s], as seen where the target begins

 private:
  double cycle_at(double time_s) const;
  bool pushes_off(double time_s) const;

  const double length_, period_s_, rate_hz_, yaw_;  // yaw_: of the target in a cycle [rad]
  std::vector<bool> pushes_off_;                    // F: a flight is about to begin; empty where it is not needed
  Eigen::Vector3d way_ = Eigen::Vector3d::Zero();   // unit; zero where the target does not travel
  Eigen::Vector3d lead_ = Eigen::Vector3d::Zero();
};

}  // namespace hydrostat::retarget

#pragma once

#include <string>

#include "physics/stepper.h"
#include "retarget/best_fit_rotation.h"
#include "retarget/replay.h"

namespace hydrostat::retarget {

/// Tells a fall: the COM lower above the ground than half the target's, or 50 degrees of tilt beyond the target's, for 0.2
/// s.
class FallWatch {
 public:
  /// Takes in the end of a control step of `seconds`; `fit` is from the target to the body. Whether it has fallen.
  bool has_fallen(const physics::Ground& ground, const RigidFit& fit, double seconds);
  /// For how long it has been falling [s].
  double seconds() const { return seconds_; }

 private:
  double seconds_ = 0;
};

struct Fall {
  double time_s;  // at which it began
  std::string cause;
};

/// Time, frame, limb and limit: the region whose nodes are furthest from where they should be, seen from the body.
std::string fall_cause(const ReplayInput& input, const physics::State& state, const physics::State& reference,
                       const RigidFit& fit, const Eigen::VectorXd& activation, double time_s);

}  // namespace hydrostat::retarget

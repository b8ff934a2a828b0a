#pragma once

#include "retarget/motion.h"

namespace hydrostat::retarget {

enum class RootMotion { kAuto, kKeep, kFromFeet, kNone };

struct RootMotionResult {
  Eigen::MatrixXd offset;  // [m] 3 x F, horizontal: added to every point of frame f
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();  // [m] added to a loop's travel a period
  bool recovered = false;
};

/// The travel that an in-place clip has lost, from the backward sliding of what stands on the ground: the offset that makes
/// the lowest points stand still, of a loop as far as an even pace and its first two harmonics do; a loop that leaps goes on evenly in the air, see leap_pace.h.
/// `com` is the centre of mass, 3 x F. kAuto recovers where a loop
/// travels less than 5 % of `length` [m] while its low points slide further than 10 % in a period; kFromFeet always, kKeep never, kNone takes the clip's own travel away.
RootMotionResult recover_root_motion(const Motion& points, const Motion& com, double length, RootMotion mode);

}  // namespace hydrostat::retarget

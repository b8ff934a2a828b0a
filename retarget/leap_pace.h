#pragma once

#include "retarget/motion.h"

namespace hydrostat::retarget {

/// Whether a loop leaps: its centre of mass `com` falls, by half of gravity or more, while nothing is near the ground. `bearing` F is 1 on
/// the ground, 0 far above it.
bool leaps(const Eigen::VectorXd& bearing, const Motion& com);

/// The pace, 2 x F [m/s, x and z], of a loop in place that leaves the ground, as the speed of the ground under it: feet slide little while
/// something is down, and the centre of mass is pushed sideways only as far as the load allows, in the air not at all. `ground` 2 x F
/// [m/s] is what the feet's sliding says, `bearing` F how far it counts, `com` 3 x F the centre of mass in place, `length` [m] L.
/// Column f is the mean speed from frame f to the next.
Eigen::MatrixXd leaping_pace(const Eigen::MatrixXd& ground, const Eigen::VectorXd& bearing, const Motion& com, double length);

}  // namespace hydrostat::retarget

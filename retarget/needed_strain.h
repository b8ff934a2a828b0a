#pragma once

#include "physics/body.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// The strain [-] below which 99 % of a motion's constraints and frames stay. `nodes` are of `body`.
double needed_strain(const physics::Body& body, const Motion& nodes);

}  // namespace hydrostat::retarget

#pragma once

#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// Lets a patch that flies off bear nothing in the last frame of its stance: one that moves sideways faster than `speed` [m/s] to the next
/// frame, while another stays. Forces of that frame would fade while the foot is on its way, and drag it. `points` are the
/// target's, by which mark_touching marked what touches.
void let_go(const Motion& points, double speed, ContactSchedule& contacts);

}  // namespace hydrostat::retarget

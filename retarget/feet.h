#pragma once

#include <vector>

#include "physics/contact.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// The feet of a schedule: its patches on legs, those that hang on a common node as one (an ankle and its toes), for they touch and leave
/// the ground as one. A foot is named for its first patch.
std::vector<Patch> feet_of(const ContactSchedule& contacts, const physics::ContactPoints& points);

}  // namespace hydrostat::retarget

#pragma once

#include <vector>

#include "retarget/performance.h"

namespace hydrostat::retarget {

/// Every effect that a simulation can have: whether it is on in this one, why, and what it costs, timed here on the creature's
/// own body: a pass of its own for what the solver does in one pass with others.
std::vector<EffectReport> effects_of(const Performer& performer, const ReplayOptions& options);

}  // namespace hydrostat::retarget

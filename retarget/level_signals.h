#pragma once

#include "retarget/level.h"

namespace hydrostat::retarget {

/// The signals of a creature on its level, which has the target, contacts and muscles already. The level gets a plan of its own: the
/// inverse dynamics of its target on its own body, for a field of strains that one mesh bears its load by leaves another
/// short of it. On top comes what was done to the solved signals since they were solved, by hand or by polish: their difference
/// to the solved creature's own plan, which is found again, of the activations' squares (of elements: their logarithms), carried as a
/// field of symmetric tensors, so that a uniform change comes over exactly. The level's limit is to the strains of its target as
/// the solved one's is to those of its own. Layers lie over the new channels as they did over the old.
SignalSet level_signals(const Performer& solved, const SignalSet& signals, const Rig& rig, const Performer& level);

}  // namespace hydrostat::retarget

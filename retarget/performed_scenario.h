#pragma once

#include "retarget/accuracy.h"
#include "retarget/performance.h"

namespace hydrostat::retarget {

/// The open loop of a creature as a scenario: its body let go at the target's start, driven by its signals, of which
/// `harmonics` are kept (0: all). Performer and signals are copied.
ScenarioOf<3> performed_scenario(const Performer& performer, const SignalSet& signals, int harmonics = 0);

/// Its motion in short windows that start from the prepared target, evenly over one period or, played once, its length: the
/// open loop's own path leaves it soon in any method.
ReferenceOf<3> performed_reference(const Performer& performer, const SignalSet& signals, const AccuracyOptions& options,
                                   bool is_checked = true);

}  // namespace hydrostat::retarget

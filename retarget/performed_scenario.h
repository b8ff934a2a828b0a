#pragma once

#include "retarget/accuracy.h"
#include "retarget/performance.h"

namespace hydrostat::retarget {

/// The same with fewer harmonics of activations and forces.
SignalSet with_harmonics(const SignalSet& signals, int harmonics);

/// A creature at the target's start in its world, as a scenario without any drive.
ScenarioOf<3> undriven_scenario(const Performer& performer);

/// The open loop of a creature as a scenario: its body let go at the target's start, driven by its signals, of which
/// `harmonics` are kept (0: all). Performer and signals are copied.
ScenarioOf<3> performed_scenario(const Performer& performer, const SignalSet& signals, int harmonics = 0);

/// Its motion in short windows that start from the prepared target, evenly over one period or, played once, its length: the
/// open loop's own path leaves it soon in any method.
ReferenceOf<3> performed_reference(const Performer& performer, const SignalSet& signals, const AccuracyOptions& options,
                                   bool is_checked = true);

/// How far a level of the creature (retarget/level.h) is from the reference: in its windows, each from the level's own target.
AccuracyRow measure_level(const ReferenceOf<3>& reference, const Performer& level, const SignalSet& signals,
                          const StepSetting& setting);

/// The closed loop from the start of the target, for two periods, 2 to 4 s. Small errors of a window may add up to a fall:
/// here they show.
Replay perform_briefly(const Performer& performer, const SignalSet& signals, const ReplayOptions& options);

/// Between replays of a creature on two control meshes, which may be one [m, RMS over the skin's vertices and the frames that
/// both have].
double skin_distance(const Performer& of_a, const Motion& a, const Performer& of_b, const Motion& b);

}  // namespace hydrostat::retarget

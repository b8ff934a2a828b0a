#pragma once

#include "retarget/flesh.h"
#include "retarget/self_contact_plan.h"

namespace hydrostat::retarget {

/// The wobble of a creature. Of the flesh's modes those are kept that the target drives, at most eight. By itself it is on
/// where the target moves some skin by 0.3 % of L or more beyond what the nodes carry. A replay of a loop begins as if it had
/// gone on for ever, one of a one-shot with the flesh at rest. `rig`: its bone_weights are those of the performer's mesh.
Wobble plan_wobble(const Performer& performer, const Rig& rig, Wish wish);

/// Of amplitudes, K x F, how far the skin is moved at most [m] in the frames.
double farthest_wobble(const Wobble& wobble, const Eigen::MatrixXd& amplitudes);

/// Processor time [s] that the wobble takes for a frame of the target, its morph targets' weights included.
double wobble_seconds(const Performer& performer);

/// The wobble in a motion of the creature's body as morph targets "wobble 1" and so on, with weights in -1..1 at that motion's
/// rate. None where it is off.
MovingMorphs wobble_morphs(const Performer& performer, const Motion& motion);

/// The same with the creature's own morph targets before it; these alone where there is no wobble.
MovingMorphs worn_with(const MovingMorphs& own, const MovingMorphs& wobble);

}  // namespace hydrostat::retarget

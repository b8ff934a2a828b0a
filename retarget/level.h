#pragma once

#include "retarget/creature.h"
#include "retarget/performance.h"

namespace hydrostat::retarget {

/// What other control meshes of a creature are made from: its bones and its skin with weights, as large as the creature,
/// and which bone owns which of its control nodes.
struct Rig {
  Skeleton skeleton;
  SkinnedMesh skin;
  Eigen::MatrixXd bone_weights;  // B x N
};

/// A creature on another control mesh, with the signals that make it do the same: no clip is read or coupled.
struct Level {
  Performer performer;
  SignalSet signals;
};

/// The creature on a mesh of `options.nodes` wished nodes; of the options element, material and friction count too: element and
/// material need not be the solved creature's.
///
/// The target's skin and the deformation inside are what the creature and its level have in common (carried_target); the level
/// makes a plan of its own for them, and what was done to the solved signals lies on top (level_signals). Muscles are made
/// anew, for they are fields over the rest body; patches keep what they do by the bones they belong to.
Level at_level(const Performer& solved, const SignalSet& signals, const Rig& rig, const CreatureOptions& options);

/// The character's body on a mesh of `nodes` wished nodes, as large as it is in the rig.
Creature level_body(const Rig& rig, const CreatureOptions& options, int nodes);

}  // namespace hydrostat::retarget

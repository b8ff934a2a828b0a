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

/// A creature on another control mesh, its signals carried over: no clip is coupled and nothing is solved again.
struct Level {
  Performer performer;
  SignalSet signals;
};

/// The creature on a mesh of `options.nodes` wished nodes; of the options element, material and friction count too, and are
/// the solved creature's.
///
/// The target's skin is what the creature and its level have in common: nodes go where the skin, and what lies inside both
/// bodies, is as in the target, with as little change of the deformation from tet to tet as that leaves open. Of the signals
/// what is carried over is the activations' squared stretch (of elements: its logarithm) less the target's own, which is
/// what bears the load: a field of symmetric tensors, linear in the tets, that fits the solved constraints best; a
/// constraint of the level has it along its direction, and its own target's stretch. So a uniform strain is carried over
/// exactly, whatever both meshes are. Muscles are made anew, for they are fields over the rest body; patches keep what they
/// do by the bones they belong to; layers of edits lie over the new channels as they did over the old.
Level at_level(const Performer& solved, const SignalSet& signals, const Rig& rig, const CreatureOptions& options);

/// The character's body on a mesh of `nodes` wished nodes, as large as it is in the rig.
Creature level_body(const Rig& rig, const CreatureOptions& options, int nodes);

}  // namespace hydrostat::retarget

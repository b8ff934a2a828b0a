#pragma once

#include "retarget/level.h"

namespace hydrostat::retarget {

/// The solved creature's prepared target on the mesh of `level`, which is the same character's. Nodes go where skin and
/// inside are, and where tets are deformed as the solved ones there; patches keep what they do by
/// the bones they belong to; then contacts, volume and balance are restored as the preparation does it, else the body would
/// not follow.
PreparedTarget carried_target(const Performer& solved, const Rig& rig, const Creature& level);

/// Of the clip's skin the vertices that are contact points, 3P x F [m], at the rate of the target.
Motion carried_clip_points(const Performer& solved, const ContactPoints& contacts);

}  // namespace hydrostat::retarget

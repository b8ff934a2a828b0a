#pragma once

#include "physics/body.h"
#include "retarget/clip.h"

namespace hydrostat::retarget {

/// Tells a creature's body what of its cells a fluid finds filled: of each tet the share that is matter, and of its surface the
/// skin's area over that of the cells, at most 1. Resistance goes by that: a convex body's shadows are a quarter of its surface in the
/// mean (Cauchy). What of the skin lies inside, or is told twice, counts too. The shares are read from what bears the stress and
/// follows the fill: the elements' own, or those of the springs of volume, which make the body's volume [m3] together. A body that
/// has neither stays as it is.
void fit_displacement(const SkinnedMesh& skin, double volume_m3, physics::Body& body);

}  // namespace hydrostat::retarget

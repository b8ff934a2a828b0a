#pragma once

#include <string>
#include <vector>

#include "io/scene.h"

namespace hydrostat::io {

/// What assimp loses of an FBX clip's curves: between keys it gives great arcs and straight lines, where the file may have
/// Bezier curves of Euler angles. Returns a sentence for what that may show in: keys many frames apart between which
/// something moves (up to 16 % of the size was measured), and turns by a large angle from one key to the next (up to 1.2 %),
/// about axes that great arc and Euler angles do not share.
/// Each names the clip, the worst bone and the mend. frame_s: of the file's rate [s].
std::vector<std::string> lost_curve_warnings(const Scene& scene, const SceneClip& clip, double frame_s);

}  // namespace hydrostat::io

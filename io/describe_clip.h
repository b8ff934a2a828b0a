#pragma once

#include "io/import.h"
#include "io/rig.h"

namespace hydrostat::io {

/// What an animator wants to know of one of a scene's clips.
ClipInfo describe_clip(const Rig& rig, const Scene& scene, std::size_t index);

}  // namespace hydrostat::io

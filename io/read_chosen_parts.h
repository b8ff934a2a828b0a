#pragma once

#include <string>

#include "io/import.h"
#include "io/scene.h"

namespace hydrostat::io {

/// The scene of a clip file with its axes and unit settled (io/scene_axes.h), and of its meshes and skeletons those that the
/// options choose (io/scene_selection.h). Throws Error.
Scene read_chosen_parts(const std::string& path, const ImportOptions& options);

}  // namespace hydrostat::io

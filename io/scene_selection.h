#pragma once

#include <string>
#include <vector>

#include "io/scene.h"

namespace hydrostat::io {

/// Leaves of a scene the meshes that are named (by name or index; none: all) and of its skeletons the one whose topmost
/// bone, or a node above it, has the name `root` (empty: the one that moves most vertices). Bones that some skin names are
/// of one skeleton when they hang on the same topmost bone, when one mesh names both, or when their topmost bones hang on
/// one node below the scene's root. What is left aside is told in the warnings. Throws Error (file: `path`) for a mesh or
/// skeleton that is not there; those that are, are listed.
void select_parts(Scene& scene, const std::vector<std::string>& meshes, const std::string& root, const std::string& path);

}  // namespace hydrostat::io

#pragma once

#include <string>

#include "io/rig.h"

namespace hydrostat::io {

/// Gives a skeleton without skin one of capsules: a round one along every bone that has a length, from its joint to each
/// child, bound to the bone whole. Its radius is a third of its length, between 2 % and 5 % of the skeleton's extent, without
/// what no bone joins to it (cameras). Told in the rig's warnings. Throws Error (file: `path`) where no bone has a length.
void add_capsules(Rig& rig, const std::string& path);

}  // namespace hydrostat::io

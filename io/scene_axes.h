#pragma once

#include <string>

#include "io/scene.h"

namespace hydrostat::io {

/// Settles which way is up and how long a unit is, where the file does not tell it (BVH) or the user knows better.
/// up: "x", "-x" ... of the file's axes, or empty; metres_per_unit: or 0. For BVH up is y, or z where the lowest joints keep
/// to one height along z and not along y; the unit is metres where that makes a height of 0.3 m to 3 m, or else a usual unit
/// of motion capture that makes a grown person, or else such that the character is 1.7 m high. What was guessed is told in
/// the warnings.
void settle_axes(Scene& scene, const std::string& up, double metres_per_unit);

}  // namespace hydrostat::io

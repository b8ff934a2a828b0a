#pragma once

#include <map>
#include <optional>

#include "io/toml_reader.h"
#include "retarget/effect_plan.h"

namespace hydrostat::io {

/// Gravity, [ground], [[obstacle]] with their moves, [water] and [air] of a scene, into a scenario whose origin is known. `warnings`
/// receives what was mended of meshes. Throws Error with the line for what is not told as it must be.
template <int Dim>
void read_surroundings(const TomlReader& root, retarget::ScenarioOf<Dim>& scenario, std::vector<std::string>& warnings);

/// [[push]].
template <int Dim>
void read_pushes(const TomlReader& root, retarget::ScenarioOf<Dim>& scenario);

/// [effects]: what is to be on or off of `names` and self_contact, and the body's friction on itself, `friction` where it is not told.
struct WishedEffects {
  std::map<std::string, retarget::Wish> wishes;
  double self_friction = 0;
};
WishedEffects read_wished_effects(const TomlReader& root, const std::vector<std::string>& names, double friction);

}  // namespace hydrostat::io

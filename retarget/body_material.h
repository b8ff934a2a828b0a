#pragma once

#include <string>

#include "physics/material.h"

namespace hydrostat::retarget {

/// What bears the stress of a creature's body: springs along the edges of its tets with an energy of volume, or finite
/// elements under an elastic law.
enum class BodyMaterial { kSprings, kStableNeoHookean, kCorotatedLinear };
constexpr BodyMaterial kBodyMaterials[] = {BodyMaterial::kSprings, BodyMaterial::kStableNeoHookean,
                                           BodyMaterial::kCorotatedLinear};

/// As the command line and files have it.
inline std::string name_of(BodyMaterial material) {
  switch (material) {
    case BodyMaterial::kSprings:
      return "springs";
    case BodyMaterial::kStableNeoHookean:
      return "stable_neo_hookean";
    case BodyMaterial::kCorotatedLinear:
      return "corotated_linear";
  }
  return {};
}

inline BodyMaterial material_of(physics::ElasticLaw law) {
  return law == physics::ElasticLaw::kCorotatedLinear ? BodyMaterial::kCorotatedLinear : BodyMaterial::kStableNeoHookean;
}

}  // namespace hydrostat::retarget

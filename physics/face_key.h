#pragma once

#include <algorithm>
#include <array>

#include "physics/body.h"

namespace hydrostat::physics {

/// The nodes of a tet's face in ascending order: the same from either side.
template <int Dim>
std::array<int, Dim> key_of_face(const BodyOf<Dim>& body, const SurfaceFace& face) {
  std::array<int, Dim> key;
  for (int k = 0, n = 0; k <= Dim; ++k) {
    if (k != face.opposite) key[static_cast<std::size_t>(n++)] = body.tets(k, face.tet);
  }
  std::sort(key.begin(), key.end());
  return key;
}

}  // namespace hydrostat::physics

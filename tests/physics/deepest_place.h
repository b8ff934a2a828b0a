#pragma once

#include <algorithm>

#include "physics/scene.h"

namespace hydrostat::physics {

/// The deepest place of the body's surface [m], looked for all over its faces, in any obstacle or the ground; 0 for none.
template <int Dim>
double deepest_place(const SceneOf<Dim>& scene, const StateOf<Dim>& state) {
  constexpr int kParts = 8;
  double deepest = 0;
  VectorOf<Dim> normal;
  for (Eigen::Index f = 0; f < scene.contact_faces.cols(); ++f) {
    for (int i = 0; i <= kParts; ++i) {
      for (int j = 0; j <= (Dim == 3 ? kParts - i : 0); ++j) {
        const double weights[3] = {1 - static_cast<double>(i + j) / kParts, static_cast<double>(i) / kParts,
                                   static_cast<double>(j) / kParts};
        VectorOf<Dim> place = VectorOf<Dim>::Zero();
        for (int k = 0; k < Dim; ++k) place += weights[k] * scene.contact_points.of(state.x, scene.contact_faces(k, f));
        for (std::size_t n = 0; n < scene.obstacles.size(); ++n) {
          VectorOf<Dim> travel = VectorOf<Dim>::Zero();
          if (state.obstacle_travel.cols() > 0) travel = state.obstacle_travel.col(static_cast<Eigen::Index>(n));
          deepest = std::max(deepest, -signed_distance<Dim>(scene.obstacles[n], travel, place, normal));
        }
        if (scene.has_ground) deepest = std::max(deepest, scene.ground.offset - scene.ground.normal.dot(place));
      }
    }
  }
  return deepest;
}

}  // namespace hydrostat::physics

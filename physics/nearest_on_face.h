#pragma once

#include <algorithm>

#include "physics/dimension.h"

namespace hydrostat::physics {

/// The point of a triangle (segment in 2D), whose corners are columns, that is nearest to `point`, by its barycentric
/// weights, and the feature that it lies on: 0 the face, 1 + k the edge from corner k, 4 + k corner k. Source: Ericson,
/// "Real-Time Collision Detection", 2005, section 5.1.5.
template <int Dim>
int nearest_on_face(const VectorOf<Dim>& point, const BlockOf<Dim>& corners, VectorOf<Dim>& weights) {
  if constexpr (Dim == 3) {
    const VectorOf<3> a = corners.col(0), b = corners.col(1), c = corners.col(2);
    const VectorOf<3> ab = b - a, ac = c - a, ap = point - a, bp = point - b, cp = point - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d1 <= 0 && d2 <= 0) return weights = {1, 0, 0}, 4;
    if (d3 >= 0 && d4 <= d3) return weights = {0, 1, 0}, 5;
    if (d6 >= 0 && d5 <= d6) return weights = {0, 0, 1}, 6;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
      const double t = d1 / (d1 - d3);
      return weights = {1 - t, t, 0}, 1;
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
      const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
      return weights = {0, 1 - t, t}, 2;
    }
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
      const double t = d2 / (d2 - d6);
      return weights = {1 - t, 0, t}, 3;
    }
    weights = VectorOf<3>(va, vb, vc) / (va + vb + vc);
    return 0;
  } else {
    const VectorOf<2> from = corners.col(0), along = corners.col(1) - from;
    const double t = (point - from).dot(along) / along.squaredNorm();
    weights = {1 - std::clamp(t, 0.0, 1.0), std::clamp(t, 0.0, 1.0)};
    return t <= 0 ? 4 : t >= 1 ? 5 : 0;
  }
}

/// Perpendicular to a face whose corners are columns, outward where they are counter-clockwise seen from outside (2D: with
/// the inside on their left). Its length is twice the area (2D: the length) of the face.
template <int Dim>
VectorOf<Dim> face_normal(const BlockOf<Dim>& corners) {
  const VectorOf<Dim> along = corners.col(1) - corners.col(0);
  if constexpr (Dim == 3) {
    return along.cross(corners.col(2) - corners.col(0));
  } else {
    return {along.y(), -along.x()};
  }
}

/// The corners of a face, whose columns of `points` it names.
template <int Dim>
BlockOf<Dim> corners_of_face(const PointsOf<Dim>& points, const Eigen::Matrix<int, Dim, 1>& face) {
  BlockOf<Dim> corners;
  for (int k = 0; k < Dim; ++k) corners.col(k) = points.col(face[k]);
  return corners;
}

}  // namespace hydrostat::physics

#pragma once

#include <Eigen/LU>

#include "physics/dimension.h"

namespace hydrostat::physics {

/// Barycentric coordinates of a point in a tet; false where that is flat or inverted.
template <int Dim>
bool coordinates_in(const PointsOf<Dim>& x, const int* nodes, const VectorOf<Dim>& point,
                    Eigen::Matrix<double, Dim + 1, 1>& weights) {
  BlockOf<Dim> spans;
  for (int k = 0; k < Dim; ++k) spans.col(k) = x.col(nodes[k + 1]) - x.col(nodes[0]);
  if (!(spans.determinant() > 0)) return false;
  weights.template tail<Dim>() = spans.inverse() * (point - x.col(nodes[0]));
  weights[0] = 1 - weights.template tail<Dim>().sum();
  return weights.allFinite();
}

}  // namespace hydrostat::physics

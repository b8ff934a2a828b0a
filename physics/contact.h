#pragma once

#include "physics/body.h"

namespace hydrostat::physics {

/// Points of the skin where contact is tested: point p is the sum over k of weights(k, p) * x(nodes(k, p)).
template <int Dim>
struct ContactPointsOf {
  Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> nodes;       // Dim + 1 x P
  Eigen::Matrix<double, Dim + 1, Eigen::Dynamic> weights;  // Dim + 1 x P, >= 0, sum 1

  int count() const { return static_cast<int>(nodes.cols()); }
  VectorOf<Dim> of(const ConstPointsOf<Dim>& nodal, int p) const {
    VectorOf<Dim> sum = nodal.col(nodes(0, p)) * weights(0, p);
    for (int k = 1; k <= Dim; ++k) sum += nodal.col(nodes(k, p)) * weights(k, p);
    return sum;
  }
};
using ContactPoints = ContactPointsOf<3>;

/// The half space normal . x >= offset is free.
template <int Dim>
struct GroundOf {
  VectorOf<Dim> normal = VectorOf<Dim>::UnitY();
  double offset = 0;      // [m]
  double friction = 0.8;  // Coulomb's coefficient [-]
};
using Ground = GroundOf<3>;

}  // namespace hydrostat::physics

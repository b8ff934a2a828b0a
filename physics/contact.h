#pragma once

#include "physics/body.h"

namespace hydrostat::physics {

/// Points of the skin where contact is tested: point p is the sum over k of weights(k, p) * x(nodes(k, p)).
struct ContactPoints {
  Eigen::Matrix4Xi nodes;    // 4 x P
  Eigen::Matrix4Xd weights;  // 4 x P, >= 0, sum 1

  int count() const { return static_cast<int>(nodes.cols()); }
  Eigen::Vector3d of(const ConstPoints& nodal, int p) const {
    return nodal.col(nodes(0, p)) * weights(0, p) + nodal.col(nodes(1, p)) * weights(1, p) +
           nodal.col(nodes(2, p)) * weights(2, p) + nodal.col(nodes(3, p)) * weights(3, p);
  }
};

/// The half space normal . x >= offset is free.
struct Ground {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  double offset = 0;      // [m]
  double friction = 0.8;  // Coulomb's coefficient [-]
};

}  // namespace hydrostat::physics

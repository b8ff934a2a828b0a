#pragma once

#include <Eigen/Core>

#include "physics/body.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// The rest shape as it lies in a target's first frame, and its longest axis on the ground.
struct LongAxis {
  Eigen::Matrix3Xd arms;  // 3 x N [m], from the centre of mass
  Eigen::Vector3d along;  // of length 1 and level; which end it points to is chance
  double slenderness;     // radius of gyration along the axis over that across it, the larger of the level and the upright one
};

LongAxis long_axis(const physics::Body& body, const Motion& target);

/// What a constraint contributes where a body bends about any axis across `along`: its arm, as far as it lies along the axis. E x 3 [m]; times
/// a direction across the axis the activations that make the body longer on that side and shorter on the other.
Eigen::MatrixX3d bends_across(const LongAxis& axis, const Eigen::Matrix2Xi& constraints);

}  // namespace hydrostat::retarget

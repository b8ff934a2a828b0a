#pragma once

#include <Eigen/Core>

#include "retarget/control_mesh.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// A skin's motion: V vertices that the moving nodes of a body carry.
struct CarriedSkin {
  const Motion& nodes;
  const Embedding& embedding;
};

/// How far two motions of one skin are from each other, at F times.
struct SkinDistance {
  Eigen::VectorXd time_s;
  Eigen::VectorXd distance_m;  // RMS over the vertices
  Eigen::VectorXd shape_m;     // of that what is left when a has been moved and turned to lie closest to b
};

/// Compares a with b at the frames of a, as long as both last; between its frames b is taken to go straight. Both start at
/// time 0, and neither is a loop. The bodies may differ, the skins have the same vertices.
SkinDistance skin_distance(const CarriedSkin& a, const CarriedSkin& b);

}  // namespace hydrostat::retarget

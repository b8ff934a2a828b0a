#pragma once

#include "retarget/motion.h"

namespace hydrostat::retarget {

/// The centre of mass of every frame [m], 3 x F; `mass` N.
Eigen::Matrix3Xd com_path(const Motion& nodes, const Eigen::VectorXd& mass);

/// How far [m] a path's highest point lies above its first: the rise of a jump that begins standing.
double apex_rise(const Eigen::Ref<const Eigen::Matrix3Xd>& path);

}  // namespace hydrostat::retarget

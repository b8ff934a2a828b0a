#pragma once

#include "retarget/performance.h"

namespace hydrostat::retarget {

/// Changes activations (E x F) as little as lets a creature hold its target against weight, inertia and the ground's forces,
/// frame by frame: what a mesh makes of a field of strains is not to the newton what another does.
///
/// min |W T^2 A^-1 (r + B d)|^2 + eps |d|^2 with the force r [N] that is left at the target, B = df / da, A = M + T D + T^2
/// K and W by mass, by at most 60 rounds of conjugate gradients. This is the metric of the inverse dynamics, without its
/// bounds and its smoothness over time; the ground's forces are found before, the least inside the friction cones that bear
/// weight and inertia. Source: Paige, Saunders, "LSQR", ACM TOMS 1982, for damped least squares without their matrix, here
/// as conjugate gradients of the normal equations (Hestenes, Stiefel, 1952, section 10).
void bear_loads(const Performer& performer, Eigen::MatrixXd& activation);

}  // namespace hydrostat::retarget

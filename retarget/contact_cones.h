#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/scene.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// One row (c, d) for each side of a contact force's friction pyramid, at points that touch and are to bear load: the force
/// stays inside while c w + d >= 0. A side that no correction at all would leave is not asked to be kept (d is not
/// negative), else muscles could not let go of it again. Five rows a sticking point, one a sliding point, whose normal force
/// alone is up to the muscles. `touching`, `bearing` P; `force` 3 x P, what the points give now; `approach` 3N x M, how the
/// nodes' velocities change by each muscle, in units of force that a point gives against them; `now` M, the muscles that led
/// to `force`. Fills `rows`, R x (M + 1).
void cone_rows(const physics::Scene& scene, const std::vector<ContactState>& touching, const std::vector<bool>& bearing,
               const Eigen::Matrix3Xd& force, const Eigen::MatrixXd& approach, const Eigen::VectorXd& now,
               Eigen::MatrixXd& rows);

/// argmin over w (M) of w' H w / 2 - b' w + weight^2 / 2 sum min(0, c w + d)^2 for a positive definite H, whose lower
/// triangle is read. Newton's method with a line search; exact once the sides that are left stay the same, after at most 50
/// turns.
Eigen::VectorXd solve_within_cones(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& b, const Eigen::MatrixXd& rows,
                                   double weight);

}  // namespace hydrostat::retarget

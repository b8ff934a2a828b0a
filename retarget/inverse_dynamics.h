#pragma once

#include "physics/stepper.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

struct InverseOptions {
  double limit = 0.3;              // |activation - 1| at most
  double shape_weight = 0.1;      // eps: per (activation - kinematic activation)^2, mean over constraints, in (mm per m of L)^2
  double smooth_weight = 0.3;     // eps_s: per second difference squared, likewise
  int sweeps = 3;                  // over the frames, for the smoothness term
  int threads = 2;
};

/// Activations and contact forces that make the body follow the target, frame by frame.
struct InverseDynamics {
  Eigen::MatrixXd activation;       // E x F [-]
  Eigen::MatrixXd penalty_force;    // E x F [N]: k (l - a l0), tension positive
  Eigen::MatrixXd contact_force;    // 3P x F [N]
  Eigen::VectorXd miss;             // F [m], mass-weighted RMS of the node miss after one frame
  InverseReport report;
};

constexpr double kMostAutomaticLimit = 0.4;  // of |activation - 1|

/// The 99th percentile of the target's constraint strain, at least 0.1, at most kMostAutomaticLimit.
double automatic_limit(const physics::Body& body, const Motion& target);

/// Solves, per frame, min |sqrt(M) Ts^2 A^-1 (rho - B u - J^T Gc alpha)|^2 + eps |u - u_kin|^2 + eps_s |u''|^2 within
/// bounds, with rho = M (x'' - g) - f_passive(x, v) and A = M + Ts D + Ts^2 K. A^-1 is not formed: the node miss y = Ts^2
/// A^-1 r is an unknown of its own, tied to r by heavy rows, so that the problem stays sparse. Where elements bear the
/// stress, B and f_passive are linearised again about each solution (Gauss and Newton), A stays as it is at u_kin. Source:
/// the design, section 6; the compliance metric as in Tan, Turk, Liu, "Soft body locomotion", SIGGRAPH 2012, section 5.
InverseDynamics solve_inverse_dynamics(const PreparedTarget& prepared, const physics::Scene& scene, double length,
                                       const InverseOptions& options);

/// Solves the same within the automatic limit, and again within one half as wide again while more than 3 % of the activations are held
/// at it and it is below 0.4: what a limb needs to bear its load comes on top of what its shape needs, and the more the thinner it is.
/// The limit of `options` is not read; the report has the one that was taken.
InverseDynamics solve_within_automatic_limit(const PreparedTarget& prepared, const physics::Scene& scene, double length,
                                             const InverseOptions& options);

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/Core>

#include "physics/internal_forces.h"
#include "retarget/reduced_modes.h"

namespace hydrostat::retarget {

/// What one control step makes of a deviation from a planned motion, for the muscles w and z = (places q [per L], speeds u [per
/// sqrt(g L)]) along the modes times sqrt(kg): u' = carry z + drive w, q' = q + advance u'.
struct LinearStep {
  Eigen::MatrixXd carry;  // R x 2R
  Eigen::MatrixXd drive;  // R x muscles
  double advance = 0;     // the step in units of L / sqrt(g L)

  /// z' (2R) by z (2R) and the muscles' activations [-].
  Eigen::VectorXd after(const Eigen::VectorXd& z, const Eigen::VectorXd& muscles) const;
};

/// Linear steps of one body along its modes. With q and u the deviations of place and speed, K and D the derivatives of the internal
/// forces and A = 1 + h D + h^2 K + h^2 kc J^T J,
///
///   u' = A^-1 (u - h K q - (kc / 4) h Jn^T Jn q + h B w),   q' = q + h u',
///
/// where J are the middles of the patches that touch by plan, each as often as it has touching points, and Jn their normals: a patch that has
/// come down elsewhere stays there, its height is the ground's, and it takes no torque. Each point by itself would be held from above as
/// well as from below, and a body that relies on soles that pull tips over as soon as they lift. K is the whole derivative: a body
/// tips over its feet by the part that compression adds, and what the Hessian's positive part alone would tell stands by itself. Dashpots at
/// work that turn give it a part without symmetry; made symmetric it would turn the body from inside. Modes that buckle faster than
/// a step can follow count as slower ones.
class LinearSteps {
 public:
  /// length [m] is L. Everything must outlive this.
  LinearSteps(const physics::Scene& scene, const Muscles& muscles, const ReducedModes& modes, double length, double step_s);

  LinearStep at(const PlannedMoment& moment);

 private:
  struct Derivatives {
    Eigen::MatrixXd stiffness, damping;  // R x R; what dashpots add to the stiffness as they turn has no symmetry
  };
  struct Holds {
    Eigen::MatrixXd stick, level;  // R x R: J^T J, Jn^T Jn
  };
  Derivatives derivatives(const PlannedMoment& moment);
  Holds holds(const PlannedMoment& moment) const;

  const physics::Scene& scene_;
  const Muscles& muscles_;
  const ReducedModes& modes_;
  const double length_, speed_unit_, step_s_, contact_mass_;
  physics::InternalForces<3> forces_;
  physics::SystemMatrix dashpots_;
};

}  // namespace hydrostat::retarget

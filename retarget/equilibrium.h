#pragma once

#include "physics/internal_forces.h"
#include "retarget/reduced_modes.h"

namespace hydrostat::retarget {

/// Moves planned moments to where their forces balance: springs, dashpots, weight and planned accelerations. Signals are a cut and
/// bounded answer, so on the target itself forces as large as many weights are left at single nodes. The body bears them by a thousandth of L;
/// but a model that is linear about the target takes them as given: they turn with whatever turns, and so the model turns a body
/// by moments that nothing outside exerts.
class Equilibrium {
 public:
  /// length [m] is L. The scene must outlive this.
  Equilibrium(const physics::Scene& scene, double length);

  /// acceleration: 3 x N [m/s2] by plan. What touches by plan is held there, by a spring that is as stiff as a step's contact; what is
  /// left of the balance, as in a flight that does not fall, pulls the body off the plan as if this caught up in a tenth of a second.
  /// Newton's method on the positive part of the Hessian. Where that brings it no nearer to a balance the moment stays.
  void settle(const Eigen::Matrix3Xd& acceleration, PlannedMoment& moment);
  /// What the planned moment lacks of its balance at each node where these are at x [m], 3 x N [N].
  Eigen::Matrix3Xd missing(const Eigen::Matrix3Xd& acceleration, const PlannedMoment& moment, const Eigen::Matrix3Xd& x);

 private:
  Eigen::Matrix3Xd missing_as_activated(const Eigen::Matrix3Xd& acceleration, const PlannedMoment& moment, const Eigen::Matrix3Xd& x) const;

  const physics::Scene& scene_;
  const double hold_;  // [N/m] of a point that touches
  physics::InternalForces<3> forces_;
  physics::SystemMatrix matrix_;
};

}  // namespace hydrostat::retarget

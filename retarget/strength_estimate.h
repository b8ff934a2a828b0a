#pragma once

#include "physics/internal_forces.h"
#include "physics/scene.h"

namespace hydrostat::retarget {

/// Seen from outside, how strong a body is for its mass against its plan, and signals that make up for it: what jumps by a plan's signals
/// leaves the ground too fast or too slowly where its stiffness or its mass is another.
///
/// Over a solver step every node obeys m (dv - g dt) = f dt + J, with the forces f inside the body and the impulse J of what it
/// touches. The sum over the body tells the mass: alpha M sum(dv - g dt) = sum(J). The moments with the places about the centre of mass,
/// sum(x (m (dv - g dt) - J / alpha)^T) = r sum(x f^T) dt with the forces that the plan's body would have there, tell the ratio r.
/// Of these moments, mean stresses times the volume, the symmetric part without its trace counts: what is turned has none, and the stiff
/// volume shakes. Both sides are smoothed alike before r is fitted, and f is taken at the two points of Gauss on the cubic between the
/// ends of the step, for between them stiff bodies shake. The fit forgets, and the plan counts for as much as it is unsure.
/// Sources: Clausius' virial, for the moments of all forces on a body; Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations
/// I", 1993, section II.1 for the quadrature and II.6 for the cubic; Ljung, "System Identification", 1999, section 11.2, for least squares
/// that forget.
class StrengthEstimate {
 public:
  /// `model` is the plan's, and must outlive the estimate. Looks come every `interval_s` [s].
  StrengthEstimate(const physics::Scene& model, double interval_s);

  /// Takes a solver step of `step_s` [s]: the states at its ends, the activations held (E) and the impulses. A step with other effects
  /// than gravity tells nothing.
  void look(double step_s, const physics::State& before, const physics::State& after, const Eigen::VectorXd& activation,
            const physics::Impulses& impulses);
  /// (stiffness / mass) over the plan's, in [0.5, 2]; 1 before anything was seen.
  double ratio() const { return ratio_; }
  /// Mass over the plan's; 1 before the body touched anything.
  double mass_ratio() const;
  /// What was commanded beyond the lengths in `x` (3 x N, where the plan has the nodes) by as much more as the body is weaker: the same
  /// pull for its mass. `activation` E; with a ratio of 1 it stays as it is.
  void apply(const Eigen::Matrix3Xd& x, Eigen::VectorXd& activation) const;

 private:
  /// Low-passed twice.
  template <class Value>
  struct Smoothed {
    Value once = Value::Zero(), twice = Value::Zero();
    void add(const Value& value, double share) {
      once += share * (value - once);
      twice += share * (once - twice);
    }
  };

  void find_push(double step_s, const physics::State& before, const physics::State& after);
  void fit();

  const physics::Scene& model_;
  physics::InternalForces<3> forces_;
  double share_, kept_, steps_alike_, ratio_ = 1;
  Smoothed<Eigen::Vector3d> momentum_, touch_;      // [N] of the plan's mass; of all contacts
  Smoothed<Eigen::Matrix3d> wanted_, push_;         // [N m] moments of m (dv / dt - g) - J / (alpha dt); of f
  double momentum_squared_ = 0, momentum_touch_ = 0;  // sums over the looks, the older the less
  double looks_ = 0, wanted_squared_ = 0, wanted_push_ = 0, push_squared_ = 0;
  physics::State between_;
  Eigen::Matrix3Xd force_, places_;
};

}  // namespace hydrostat::retarget

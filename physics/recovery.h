#pragma once

#include "physics/stepper.h"

namespace hydrostat::physics {

/// `method`, and in its place, while a large part of the body is inside out, forces that lead each of its pieces back to its rest
/// shape. An elastic energy has minima far from that: a body whose nodes lie anywhere may wind twice around an edge with no
/// element inverted, and stay so.
///
/// Every node is drawn to its place in the rest shape, turned and moved as it fits best, like a critically damped oscillator.
/// These forces depend on the body alone: they sum to zero, in moments too, so that linear and angular momentum change by gravity,
/// contact and effects, to rounding. They start with a small share of the energy of the elastic forces, and it is damped away. Steps taken so count as guard steps; bodies with held nodes are left to `method`.
/// Source: Mueller, Heidelberger, Teschner, Gross, "Meshless deformations based on shape matching", TOG 24(3), 2005, section 3.3,
/// with forces in the place of its displacements.
template <int Dim>
class RecoveringStepper final : public StepperOf<Dim> {
 public:
  /// The scene must outlive the stepper.
  RecoveringStepper(const SceneOf<Dim>& scene, std::unique_ptr<StepperOf<Dim>> method);
  ~RecoveringStepper() override;

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override;
  double substep(double dt) const override { return method_->substep(dt); }
  void forget() override;
  long guard_steps() const override { return method_->guard_steps() + steps_; }
  StepWork work() const override;

  /// Whether the next step, too, is one back to the rest shape.
  bool is_recovering() const { return is_recovering_; }

 private:
  class Recovery;
  std::unique_ptr<Recovery> recovery_;
  std::unique_ptr<StepperOf<Dim>> method_;
  long steps_ = 0;
  bool is_recovering_ = false;
};

}  // namespace hydrostat::physics

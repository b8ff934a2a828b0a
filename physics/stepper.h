#pragma once

#include <memory>
#include <optional>
#include <string>

#include "physics/scene.h"
#include "physics/step_work.h"

namespace hydrostat::physics {

enum class Termination { kDone, kDiverged };

/// One method of time integration bound to one scene; it keeps scratch memory, steps allocate nothing.
template <int Dim>
class StepperOf {
 public:
  virtual ~StepperOf() = default;
  /// Moves `state` on by `dt` [s] under `activation` (E, held). `effect_force` [N] Dim x N, or null for none.
  /// kDiverged: a value is not finite or the energy ran away; the state is then the one before the step.
  virtual Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force,
                           StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) = 0;
  /// The method's own substep [s] for an outer step dt from the rest shape.
  virtual double substep(double dt) const = 0;
  /// Its substeps from now on: so many times as short as its own bound asks for. False: it has none, and all stays as it is.
  virtual bool shorten([[maybe_unused]] int times) { return false; }
  /// To be called when the next state is not the one that the last step left behind.
  virtual void forget() {}
  /// Steps so far in which another method took over.
  virtual long guard_steps() const { return 0; }
  virtual StepWork work() const { return {}; }
};
using Stepper = StepperOf<3>;

enum class Method { kExplicit, kImplicit, kEuler, kXpbd, kSpring };
constexpr Method kMethods[] = {Method::kExplicit, Method::kImplicit, Method::kEuler, Method::kXpbd, Method::kSpring};
std::string name_of(Method method);
/// None for a name that no method has.
std::optional<Method> method_named(const std::string& name);
/// explicit and implicit come guarded (make_guarded_stepper). Throws nothing; every scene is accepted. The scene must outlive
/// the stepper.
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_stepper(Method method, const SceneOf<Dim>& scene);

struct GuardOptions {
  double growth;       // of the energy [-] in a step beyond the work on the body, that the method's own velocities show when all is well
  int most_parts = 1;  // a power of two: in two, four ... parts up to it a step is tried again that follows a sound one
  bool is_staggered = false;  // velocities lie half a substep, one pass over the body, away from the places at which forces are taken
};
/// A step of `accurate` that ends with an inverted tet, with much more energy than was there or was brought in, or with what
/// is no number is tried again in shorter ones (of a method with substeps: in shorter of those), where the options say so, and
/// then taken again by euler, and so is every step from a state with an inverted tet.
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_guarded_stepper(const SceneOf<Dim>& scene, std::unique_ptr<StepperOf<Dim>> accurate,
                                                     const GuardOptions& options);

/// Its steps diverge where the stability bound asks for more than `most_substeps`.
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_explicit_stepper(const SceneOf<Dim>& scene, double most_substeps = 2000);
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_euler_stepper(const SceneOf<Dim>& scene);
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_implicit_stepper(const SceneOf<Dim>& scene);
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_xpbd_stepper(const SceneOf<Dim>& scene);
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_spring_stepper(const SceneOf<Dim>& scene);

}  // namespace hydrostat::physics

#pragma once

#include <memory>
#include <vector>

#include "physics/scene.h"

namespace hydrostat::physics {

/// Forces from without that hang on the state. They are handed to a stepper as its effect_force, whatever its method, which
/// books them; each is held over the outer step.
template <int Dim>
class EffectOf {
 public:
  virtual ~EffectOf() = default;
  /// Adds what acts on the nodes in a step of dt [s] that begins at a state [N]; allocates nothing.
  virtual void add_forces(double dt, const StateOf<Dim>& state, PointsOf<Dim>& force) = 0;
};

/// The effects that a scene has, in the order in which they act. What is not in it costs nothing. The scene must outlive
/// them.
template <int Dim>
std::vector<std::unique_ptr<EffectOf<Dim>>> plan_effects(const SceneOf<Dim>& scene);

}  // namespace hydrostat::physics

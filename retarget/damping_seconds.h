#pragma once

#include "physics/stepper.h"

namespace hydrostat::retarget {

/// Processor time [s] that a body's dashpots take of one substep of `method` in steps of `dt` [s], at `state`: all
/// stages where they go in such.
template <int Dim>
double damping_seconds(const physics::SceneOf<Dim>& scene, physics::Method method, double dt, const physics::StateOf<Dim>& state);

}  // namespace hydrostat::retarget

#pragma once

#include "physics/stepper.h"

namespace hydrostat::physics {

/// Euler that goes on where its solver finds no end: the places that it came to are lower in potential than those from which
/// it started, and the way there gives the velocities. It keeps linear momentum, too, and finds out of shapes that are far
/// from any that the body can have; for the guard.
template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_forgiving_euler_stepper(const SceneOf<Dim>& scene);

}  // namespace hydrostat::physics

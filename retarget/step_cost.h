#pragma once

#include "physics/stepper.h"

namespace hydrostat::retarget {

/// What work on a scene's body is worth [ms]: counts times a table of constants (step_cost.cpp), so that a choice by it
/// hangs on the scene alone, never on the clock. Effects and contact are not in it: every method has the same.
template <int Dim>
double counted_ms(const physics::SceneOf<Dim>& scene, physics::Method method, const physics::StepWork& work);

/// Of outer steps beside their substeps: a guarded method looks at every one. Only `explicit` can have so many that it shows.
template <int Dim>
double counted_ms_of_steps(const physics::SceneOf<Dim>& scene, physics::Method method, double steps);

/// Of playing a creature's signals at one time: what fewer harmonics save.
double counted_ms_of_signals(Eigen::Index channels, int harmonics);

/// The same of one correction by so many muscles, the mean of many: the response of the body to every muscle (its matrix
/// assembled, factored and solved with, the products of what comes out), and what every call does with it.
double counted_ms_of_correction(const physics::Scene& scene, Eigen::Index muscles);

}  // namespace hydrostat::retarget

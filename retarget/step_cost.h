#pragma once

#include "physics/stepper.h"

namespace hydrostat::retarget {

/// What so many outer steps and the work in them are worth on a scene's body [ms]: counts times a table of constants
/// (step_cost.cpp), so that a choice by it hangs on the scene alone, never on the clock. Water and air count by the places of the
/// body's surface, wherever these are; contact as often as places were looked at and pushed.
/// `is_active`: activations change, of which finite elements ask more.
template <int Dim>
double counted_ms(const physics::SceneOf<Dim>& scene, physics::Method method, bool is_active, double steps,
                  const physics::StepWork& work);

/// Of playing a creature's signals at one time [ms]: what fewer harmonics save.
double counted_ms_of_signals(Eigen::Index channels, int harmonics);

/// The same of one correction by so many muscles, the mean of many [ms]: the response of the body to every muscle (its matrix
/// assembled, factored and solved with, the products of what comes out), and what every call does with it.
double counted_ms_of_correction(const physics::Scene& scene, Eigen::Index muscles);

}  // namespace hydrostat::retarget

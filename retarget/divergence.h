#pragma once

#include <string>

#include "physics/stepper.h"

namespace hydrostat::retarget {

/// What is known of a step of `dt_s` from `time_s` that a method could not take: `state` is the one before it.
template <int Dim>
std::string divergence_cause(const physics::BodyOf<Dim>& body, const physics::StateOf<Dim>& state, physics::Method method, double dt_s,
                             double time_s);

}  // namespace hydrostat::retarget

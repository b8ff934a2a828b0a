#pragma once

#include <string>

#include "retarget/scenario.h"

namespace hydrostat::retarget {

/// What is to be told where `explicit` would want more substeps of a step of `dt` [s] than it may take, so that its guard takes
/// every step: the longest damping time [s] that would do where the body has `damping_time`, or that none would. Empty where all
/// is well.
template <int Dim>
std::string explicit_step_warning(const physics::SceneOf<Dim>& scene, double dt, double damping_time);

}  // namespace hydrostat::retarget

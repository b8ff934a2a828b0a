#pragma once

namespace hydrostat::retarget {

inline constexpr double kGravity = 9.81;  // [m/s2] of the clip's own world, and of the units in which figures are told

}  // namespace hydrostat::retarget

#include "retarget/step_warning.h"

#include <cmath>
#include <cstdio>

namespace hydrostat::retarget {
namespace {

constexpr double kMostSubsteps = 2000;  // as make_explicit_stepper has it
constexpr double kSpare = 0.7;          // of the damping time that would just do at rest: bodies stiffen when they deform

template <int Dim>
double substep_with(physics::SceneOf<Dim> scene, double damping_share, double dt) {
  scene.body.edge_damping *= damping_share;
  return physics::make_explicit_stepper(scene)->substep(dt);
}

}  // namespace

/// The bound h on a substep obeys 4 - 2 h d - h^2 k = 0 (physics/explicit.cpp), d growing with the damping time: two of them tell
/// d and k.
template <int Dim>
std::string explicit_step_warning(const physics::SceneOf<Dim>& scene, double dt, double damping_time) {
  const double h = substep_with<Dim>(scene, 1, dt), wanted = dt / kMostSubsteps;
  if (h >= wanted) return {};
  const double undamped = substep_with<Dim>(scene, 0, dt), k = 4 / (undamped * undamped), d = (4 - h * h * k) / (2 * h);
  const double share = (4 - wanted * wanted * k) / (2 * wanted * d);
  char text[320];
  const int count = std::snprintf(text, sizeof text,
                                  "method 'explicit' would want %.0f substeps of a step, where it may take %.0f: its guard 'euler' takes "
                                  "every step; ",
                                  dt / h, kMostSubsteps);
  if (damping_time > 0 && share > 0) {
    std::snprintf(text + count, sizeof text - static_cast<std::size_t>(count),
                  "give [material] damping_time_s = %.1g or less, or take method \"implicit\"", kSpare * share * damping_time);
  } else {
    std::snprintf(text + count, sizeof text - static_cast<std::size_t>(count), "take method \"implicit\" or a smaller dt_s");
  }
  return text;
}

template std::string explicit_step_warning<2>(const physics::SceneOf<2>&, double, double);
template std::string explicit_step_warning<3>(const physics::SceneOf<3>&, double, double);

}  // namespace hydrostat::retarget

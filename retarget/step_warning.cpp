#include "retarget/step_warning.h"

#include <cmath>
#include <cstdio>

namespace hydrostat::retarget {
namespace {

constexpr double kMostSubsteps = 2000;  // as make_explicit_stepper has it
constexpr double kSpare = 0.7;          // of the damping time that would just do at rest: bodies stiffen when they deform
constexpr double kStride = 1.5, kExactness = 1.05;  // between shares that are tried, and of the one that is found
constexpr double kLeastFound = 1e-6;

template <int Dim>
double substep_with(physics::SceneOf<Dim> scene, double damping_share, double dt) {
  scene.body.edge_damping *= damping_share;
  return physics::make_explicit_stepper(scene)->substep(dt);
}

/// The largest share of the damping with which a step takes no more than what is wanted, 0 where none does. It is sought from above, for
/// dashpots that go in stages may do where weaker ones, that do not yet, would not.
template <int Dim>
double largest_share(const physics::SceneOf<Dim>& scene, double wanted, double dt) {
  double high = 1, low = high;
  while (substep_with<Dim>(scene, low, dt) < wanted) {
    high = low;
    low /= kStride;
    if (low < kLeastFound) return 0;
  }
  while (high > kExactness * low) {
    const double middle = std::sqrt(low * high);
    (substep_with<Dim>(scene, middle, dt) < wanted ? high : low) = middle;
  }
  return low;
}

}  // namespace

template <int Dim>
std::string explicit_step_warning(const physics::SceneOf<Dim>& scene, double dt, double damping_time) {
  const double h = substep_with<Dim>(scene, 1, dt), wanted = dt / kMostSubsteps;
  if (h >= wanted) return {};
  const double share = largest_share<Dim>(scene, wanted, dt);
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

#include "retarget/fold_energy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "retarget/reach.h"

namespace hydrostat::retarget {
namespace {

constexpr double kPartsApart = 3;   // widths [-] between the middles of parts that do not meet yet
constexpr double kSwing = 2;        // of L [m]: how far the middle of a clamped body sinks, at most
constexpr double kTouch = 1e-6;     // of L [m]: how deep a body may start in what it touches
constexpr double kForEver = 1e299;  // [s]: a clamp that lets go then never does

template <int Dim>
double fall_of(const ScenarioOf<Dim>& scenario, double duration_s) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  double fall = longest_way(scenario, duration_s);
  const physics::VectorOf<Dim> down = scene.gravity.normalized(), centre = physics::centre_of_mass(scene.body, scenario.start.x);
  const auto& ground = scene.ground;
  if (scene.has_ground && ground.normal.dot(down) < -1 + 1e-9) fall = std::min(fall, std::max(0.0, ground.normal.dot(centre) - ground.offset));
  const bool is_held = std::any_of(scenario.clamps.begin(), scenario.clamps.end(),
                                   [](const Clamp& clamp) { return !clamp.nodes.empty() && clamp.until_s > kForEver; });
  return is_held ? std::min(fall, kSwing * scenario.length) : fall;
}

/// [J]
template <int Dim>
double energy_given(const ScenarioOf<Dim>& scenario, double duration_s) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const double mass = scene.body.mass.sum(), gravity = scene.gravity.norm();
  double speed_squared = (scenario.start.v.colwise().squaredNorm() * scene.body.mass).value() / mass;
  if (gravity > 0) speed_squared += 2 * gravity * fall_of(scenario, duration_s);
  double speed = std::sqrt(speed_squared);
  for (const PushOf<Dim>& push : scenario.pushes) speed += push.delta_v.norm();
  return mass / 2 * speed * speed;
}

/// Nothing pushes it out of what it starts in.
template <int Dim>
bool stands_clear(const ScenarioOf<Dim>& scenario) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const double least = -kTouch * scenario.length;
  if (scene.has_ground && (scene.ground.normal.transpose() * scenario.start.x).minCoeff() - scene.ground.offset < least) return false;
  for (const physics::ObstacleOf<Dim>& obstacle : scene.obstacles) {
    for (const auto node : scenario.start.x.colwise()) {
      physics::VectorOf<Dim> normal;
      if (physics::signed_distance<Dim>(obstacle, physics::VectorOf<Dim>::Zero(), node, normal) < least) return false;
    }
  }
  return true;
}

template <int Dim>
bool is_bounded(const ScenarioOf<Dim>& scenario) {
  const auto flows = [](const auto& fluid) { return fluid && fluid->velocity.norm() > 0; };
  return stands_clear(scenario) && scenario.waves.empty() && !scenario.drive && scenario.moves.empty() && !flows(scenario.scene.water) &&
         !flows(scenario.scene.air) && !(scenario.scene.water && scenario.scene.gravity.norm() > 0);
}

}  // namespace

template <int Dim>
double energies_to_fold(const ScenarioOf<Dim>& scenario, const Bar& bar, double duration_s) {
  if (bar.length <= 0 || !is_bounded(scenario)) return 0;
  const double section = scenario.scene.body.rest_volume.sum() / bar.length;
  double needed = std::numeric_limits<double>::infinity();
  for (const double width : {bar.thickness, bar.breadth}) {
    const double turn = 2 * std::acos(std::min(1.0, kPartsApart * width / bar.length));
    needed = std::min(needed, bar.softest * section * width * width / 12 * turn * turn / (2 * bar.length));
  }
  const double given = energy_given(scenario, duration_s);
  return given > 0 ? needed / given : std::numeric_limits<double>::infinity();
}

template double energies_to_fold<2>(const ScenarioOf<2>&, const Bar&, double);
template double energies_to_fold<3>(const ScenarioOf<3>&, const Bar&, double);

}  // namespace hydrostat::retarget

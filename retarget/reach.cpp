#include "retarget/reach.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

using physics::VectorOf;

constexpr double kExtent = 2;  // of L [-]: no part of a body that nothing holds is farther from its centre of mass
constexpr int kPlaces = 64;    // of the parabola, between which it is no longer than straight pieces are

template <int Dim>
double pushed_way(const ScenarioOf<Dim>& scenario, double duration_s) {
  double way = 0;
  for (const PushOf<Dim>& push : scenario.pushes) way += push.delta_v.norm() * std::max(0.0, duration_s - push.time_s);
  return way;
}

/// The way of a body through empty space.
template <int Dim>
class Flight {
 public:
  Flight(const ScenarioOf<Dim>& scenario, double duration_s)
      : scenario_(scenario),
        duration_s_(duration_s),
        centre_(physics::centre_of_mass(scenario.scene.body, scenario.start.x)),
        velocity_(physics::momentum(scenario.scene.body, scenario.start.v) / scenario.scene.body.mass.sum()),
        radius_(kExtent * scenario.length + pushed_way(scenario, duration_s)) {}

  /// Comes to where normal . x is below offset.
  bool goes_below(const VectorOf<Dim>& normal, double offset) const {
    const double height = normal.dot(centre_) - offset, speed = normal.dot(velocity_), pull = normal.dot(scenario_.scene.gravity);
    double lowest = std::min(height, height + duration_s_ * (speed + pull * duration_s_ / 2));
    if (pull > 0 && speed < 0 && -speed / pull < duration_s_) lowest = height - speed * speed / (2 * pull);  // where it turns around
    return lowest <= radius_;
  }

  bool goes_to(std::size_t obstacle) const {
    const physics::ObstacleOf<Dim>& one = scenario_.scene.obstacles[obstacle];
    double moved = 0;
    for (const MoveOf<Dim>& move : scenario_.moves) {
      if (static_cast<std::size_t>(move.obstacle) == obstacle)
        moved += move.velocity.norm() * std::max(0.0, std::min(duration_s_, move.until_s) - move.from_s);
    }
    VectorOf<Dim> before = centre_;
    for (int k = 0; k <= kPlaces; ++k) {
      const double t = duration_s_ * k / kPlaces;
      const VectorOf<Dim> place = centre_ + t * (velocity_ + t / 2 * scenario_.scene.gravity);
      const double gap = physics::distance_at_least<Dim>(one, VectorOf<Dim>::Zero(), place);
      if (gap - (place - before).norm() <= radius_ + moved) return true;
      before = place;
    }
    return false;
  }

  double distance_to(std::size_t obstacle) const {
    return physics::distance_at_least<Dim>(scenario_.scene.obstacles[obstacle], VectorOf<Dim>::Zero(), centre_);
  }
  const VectorOf<Dim>& centre() const { return centre_; }

 private:
  const ScenarioOf<Dim>& scenario_;
  const double duration_s_;
  const VectorOf<Dim> centre_, velocity_;
  const double radius_;  // [m] about the parabola, within which all of the body is
};

/// It has energy of its own to give.
template <int Dim>
bool is_driven(const ScenarioOf<Dim>& scenario) {
  return !scenario.waves.empty() || scenario.drive || scenario.start.x != scenario.scene.body.rest;
}

template <int Dim>
bool flows(const std::optional<physics::FluidOf<Dim>>& fluid) {
  return fluid && fluid->velocity.norm() > 0;
}

}  // namespace

template <int Dim>
double longest_way(const ScenarioOf<Dim>& scenario, double duration_s) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const double mass = scene.body.mass.sum();
  const double speed = std::sqrt((scenario.start.v.colwise().squaredNorm() * scene.body.mass).value() / mass);
  const double buoyancy = scene.water ? scene.water->density * scene.body.rest_volume.sum() / mass : 0;  // of the weight
  return duration_s * (speed + (1 + buoyancy) * scene.gravity.norm() * duration_s / 2) + pushed_way(scenario, duration_s);
}

template <int Dim>
Reach reach_of(const ScenarioOf<Dim>& scenario, double duration_s) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const Flight<Dim> flight(scenario, duration_s);
  const VectorOf<Dim> up = VectorOf<Dim>::Unit(1);
  const bool has_level = scene.water && std::isfinite(scene.water->level), is_sunk = scene.water && !has_level;
  if (!scenario.clamps.empty() || flows<Dim>(scene.air)) return {true, true, true};
  if ((is_sunk || scene.air) && (is_driven(scenario) || flows<Dim>(scene.water))) return {true, true, true};

  Reach reach;
  reach.ground = scene.has_ground && flight.goes_below(scene.ground.normal, scene.ground.offset);
  reach.water = is_sunk || (has_level && flight.goes_below(up, scene.water->level));
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k) reach.obstacles = reach.obstacles || flight.goes_to(k);
  const bool leaves_parabola = scene.air || reach.ground || reach.water || reach.obstacles;
  if (!leaves_parabola) return reach;
  if (is_driven(scenario) || flows<Dim>(scene.water) || !scenario.moves.empty()) return {true, true, true};
  const double radius = kExtent * scenario.length + longest_way(scenario, duration_s);
  reach.ground = reach.ground || (scene.has_ground && scene.ground.normal.dot(flight.centre()) - scene.ground.offset <= radius);
  reach.water = reach.water || (has_level && flight.centre()[1] - scene.water->level <= radius);
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k) {
    reach.obstacles = reach.obstacles || flight.distance_to(k) <= radius;
  }
  return reach;
}

template double longest_way<2>(const ScenarioOf<2>&, double);
template double longest_way<3>(const ScenarioOf<3>&, double);
template Reach reach_of<2>(const ScenarioOf<2>&, double);
template Reach reach_of<3>(const ScenarioOf<3>&, double);

}  // namespace hydrostat::retarget

#include "io/scene_surroundings.h"

#include <cmath>

#include "io/scene_shapes.h"

namespace hydrostat::io {
namespace {

using physics::VectorOf;
using retarget::ScenarioOf;

constexpr double kSteepest = 80;    // [deg] of the ground
constexpr double kSurfaceFriction = 0.8;
constexpr double kAirDensity = 1.2;  // [kg/m3]
constexpr Within kFrictionRange{.least = 0, .most = 10};
const std::vector<std::string> kWishes{"auto", "on", "off"};

/// Where the ground's normal leans away from: +x, turned about y in three dimensions.
template <int Dim>
VectorOf<Dim> way_up(const TomlReader& ground) {
  VectorOf<Dim> way = VectorOf<Dim>::UnitX();
  if constexpr (Dim == 3) {
    const double heading = radians(ground.number_or("slope_heading_deg", 0, {.least = -360, .most = 360}));
    way << std::cos(heading), 0, -std::sin(heading);
  }
  return way;
}

template <int Dim>
physics::GroundOf<Dim> read_ground(const TomlReader& table, const VectorOf<Dim>& origin) {
  const double slope = radians(table.number_or("slope_deg", 0, {.least = -kSteepest, .most = kSteepest}));
  physics::GroundOf<Dim> ground;
  ground.normal = std::cos(slope) * VectorOf<Dim>::UnitY() - std::sin(slope) * way_up<Dim>(table);
  ground.offset = table.number_or("height_m", 0, kPlace) * ground.normal[1] - ground.normal.dot(origin);
  ground.friction = table.number_or("friction", kSurfaceFriction, kFrictionRange);
  table.refuse_others();
  return ground;
}

template <int Dim>
physics::FluidOf<Dim> read_fluid(const TomlReader& table, physics::FluidOf<Dim> fluid) {
  constexpr Within kCoefficient{.least = 0, .most = 100};
  fluid.density = table.number_or("density_kg_m3", fluid.density, {.least = 0, .most = 1e5, .without_least = true});
  fluid.velocity = table.numbers_or("velocity_m_s", VectorOf<Dim>::Zero());
  fluid.drag = table.number_or("drag", fluid.drag, kCoefficient);
  fluid.drag_along = table.number_or("drag_along", fluid.drag_along, kCoefficient);
  table.refuse_others();
  return fluid;
}

template <int Dim>
physics::ObstacleOf<Dim> read_obstacle(const TomlReader& table, const VectorOf<Dim>& origin, std::vector<std::string>& warnings) {
  physics::ObstacleOf<Dim> obstacle;
  const std::string mesh = Dim == 3 ? "mesh" : "outline";
  const std::string shape = table.choice("shape", {"box", "ball", "half_space", mesh});
  if (shape == "box") {
    obstacle.shape = physics::BoxOf<Dim>{table.number_or_numbers("size_m", Dim, kLength) / 2};
  } else if (shape == "ball") {
    obstacle.shape = physics::Ball{table.number("size_m", kLength) / 2};
  } else if (shape == mesh) {
    obstacle.shape = surface_of<Dim>(table, warnings);
  }
  obstacle.place = table.numbers_or("position_m", VectorOf<Dim>::Zero(), kPlace) - origin;
  obstacle.turn = rotation_of<Dim>(table);
  obstacle.friction = table.number_or("friction", kSurfaceFriction, kFrictionRange);
  return obstacle;
}

template <int Dim>
void read_moves(const TomlReader& table, int obstacle, std::vector<retarget::MoveOf<Dim>>& moves) {
  for (const TomlReader& move : table.tables("move")) {
    retarget::MoveOf<Dim> moving;
    moving.obstacle = obstacle;
    moving.velocity = move.numbers("velocity_m_s", Dim);
    moving.from_s = move.number_or("from_s", 0, kNotNegative);
    moving.until_s = move.number_or("until_s", moving.until_s, {.least = moving.from_s, .without_least = true});
    move.refuse_others();
    moves.push_back(moving);
  }
}

}  // namespace

template <int Dim>
void read_surroundings(const TomlReader& root, ScenarioOf<Dim>& scenario, std::vector<std::string>& warnings) {
  physics::SceneOf<Dim>& scene = scenario.scene;
  scene.gravity = root.numbers_or("gravity_m_s2", -9.81 * VectorOf<Dim>::UnitY());
  const std::optional<TomlReader> ground = root.table("ground");
  scene.has_ground = ground.has_value();
  if (ground) scene.ground = read_ground<Dim>(*ground, scenario.origin);
  for (const TomlReader& table : root.tables("obstacle")) {
    physics::ObstacleOf<Dim> obstacle = read_obstacle<Dim>(table, scenario.origin, warnings);
    read_moves<Dim>(table, static_cast<int>(scene.obstacles.size()), scenario.moves);
    table.refuse_others();
    scene.obstacles.push_back(std::move(obstacle));
  }
  if (const std::optional<TomlReader> water = root.table("water")) {
    physics::FluidOf<Dim> fluid;
    if (water->has("level_m")) fluid.level = water->number("level_m", kPlace) - scenario.origin[1];
    scene.water = read_fluid<Dim>(*water, fluid);
  }
  if (const std::optional<TomlReader> air = root.table("air")) {
    physics::FluidOf<Dim> fluid;
    fluid.density = kAirDensity;
    scene.air = read_fluid<Dim>(*air, fluid);
  }
}

template <int Dim>
void read_pushes(const TomlReader& root, ScenarioOf<Dim>& scenario) {
  for (const TomlReader& table : root.tables("push")) {
    retarget::PushOf<Dim> push;
    push.time_s = table.number("time_s", kNotNegative);
    push.duration_s = table.number_or("duration_s", push.duration_s, kAboveZero);
    push.delta_v = table.numbers("delta_v_m_s", Dim);
    table.refuse_others();
    scenario.pushes.push_back(push);
  }
}

WishedEffects read_wished_effects(const TomlReader& root, const std::vector<std::string>& names, double friction) {
  WishedEffects wished{{}, friction};
  const std::optional<TomlReader> table = root.table("effects");
  if (!table) return wished;
  const auto read = [&](const std::string& name) {
    const std::string wish = table->choice_or_first(name, kWishes);
    wished.wishes[name] = wish == "on" ? retarget::Wish::kOn : wish == "off" ? retarget::Wish::kOff : retarget::Wish::kAuto;
  };
  read("self_contact");
  for (const std::string& name : names) read(name);
  wished.self_friction = table->number_or("self_friction", friction, kFrictionRange);
  table->refuse_others();
  if (wished.wishes["self_contact"] == retarget::Wish::kOff && table->has("self_friction")) {
    throw table->refusal("self_friction", "'self_contact' is off, so that nothing rubs", "Leave one of the two out.");
  }
  return wished;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                             \
  template void read_surroundings<Dim>(const TomlReader&, ScenarioOf<Dim>&, std::vector<std::string>&);        \
  template void read_pushes<Dim>(const TomlReader&, ScenarioOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::io

#include "io/creature_scene.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "io/scene_shapes.h"
#include "io/scene_surroundings.h"
#include "io/toml_reader.h"
#include "retarget/displacement.h"
#include "retarget/performed_scenario.h"

namespace hydrostat::io {
namespace {

using Eigen::Vector3d;

constexpr const char* kSceneSchema = "hydrostat.creature_scene/1";
constexpr double kDeepest = 0.01;  // per L: what starts deeper in an obstacle is swallowed, what is less deep is lifted out
constexpr double kFarCells = 4;    // along the body, as plan_self_contact has it
const std::vector<std::string> kOfTheWorld{"schema", "gravity_m_s2", "ground", "obstacle", "push", "water", "air", "effects"};
const std::vector<std::string> kOfTheBody{"body", "material", "region", "clamp", "seam", "activation"};
const std::vector<std::string> kOfTheRun{"dimension", "duration_s", "dt_s", "method", "seed"};
const std::vector<std::string> kBodyEffects{"volume", "damping", "fracture"};

/// Refuses what is a scene's without a clip, and what nobody knows.
void refuse_what_is_not_of_the_world(const TomlReader& root) {
  for (const std::string& key : kOfTheBody) {
    if (!root.has(key)) continue;
    throw root.refusal(key, "'" + key + "' is a body's, and a creature's body comes from its clip",
                       "Leave it out, or simulate the scene by itself with 'hydrostat simulate'.");
  }
  for (const std::string& key : kOfTheRun) {
    if (!root.has(key)) continue;
    throw root.refusal(key, "'" + key + "' is a simulation's without a clip; a creature is three-dimensional and goes by the options of its command",
                       "Leave it out, and see 'hydrostat replay --help'.");
  }
  for (const std::string& key : kOfTheWorld) root.has(key);
  root.refuse_others();
  if (root.has("schema")) root.choice("schema", {kSceneSchema});
  const std::optional<TomlReader> effects = root.table("effects");
  for (const std::string& key : kBodyEffects) {
    if (!effects || !effects->has(key)) continue;
    throw effects->refusal(key, "'" + key + "' is an effect of the body, and a creature's body comes from its clip", "Leave it out.");
  }
}

/// The least turn that brings the vertical of the ground's frame to the ground's normal.
Eigen::Matrix3d turn_to(const Vector3d& normal) {
  const Vector3d axis = Vector3d::UnitY().cross(normal);
  const double sine = axis.norm();
  if (sine == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(std::atan2(sine, normal.y()), axis / sine).toRotationMatrix();
}

/// From the world's frame to that of the ground.
void turn_surroundings(const retarget::World& world, retarget::ScenarioOf<3>& scenario) {
  physics::Scene& scene = scenario.scene;
  const Eigen::Matrix3d back = world.turn.transpose();
  if (world.is_turned()) scene.gravity = back * scene.gravity;
  for (physics::ObstacleOf<3>& obstacle : scene.obstacles) {
    obstacle.place = world.pivot + back * (obstacle.place - world.pivot);
    obstacle.turn = back * obstacle.turn;
  }
  for (retarget::MoveOf<3>& move : scenario.moves) move.velocity = back * move.velocity;
  for (retarget::Push& push : scenario.pushes) push.delta_v = back * push.delta_v;
  // Its level counts from the pivot upward, against gravity.
  const double gravity = scene.gravity.norm();
  const Vector3d up = gravity > 0 ? Vector3d(-scene.gravity / gravity) : Vector3d::UnitY();
  for (std::optional<physics::FluidOf<3>>* fluid : {&scene.water, &scene.air}) {
    if (!*fluid) continue;
    (*fluid)->velocity = back * (*fluid)->velocity;
    (*fluid)->level += up.dot(world.pivot);
  }
}

void refuse_buried_start(const TomlReader& root, const physics::Ground& ground) {
  if (ground.offset <= 0) return;
  throw root.table("ground")->refusal("height_m", "the ground would lie over the creature's feet, which start at height 0",
                                      "Give 0 or less, and move the obstacles instead.");
}

void refuse_swallowing(const TomlReader& root, const retarget::ScenarioOf<3>& scenario) {
  const physics::Scene& scene = scenario.scene;
  for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
    double deepest = 0;
    Vector3d normal;
    const auto look = [&](const Vector3d& place) {
      if (physics::distance_at_least<3>(scene.obstacles[o], Vector3d::Zero(), place) > 0) return;
      deepest = std::min(deepest, physics::signed_distance<3>(scene.obstacles[o], Vector3d::Zero(), place, normal));
    };
    for (const auto place : scenario.start.x.colwise()) look(place);
    for (int p = 0; p < scene.contact_points.count(); ++p) look(scene.contact_points.of(scenario.start.x, p));
    if (deepest > -kDeepest * scenario.length) continue;
    char text[120];
    std::snprintf(text, sizeof text, "the creature would start %.3g m deep in this obstacle", -deepest);
    throw root.tables("obstacle")[o].refusal("position_m", text,
                                             "Move it away: places count from the ground under the creature's centre of mass.");
  }
}

/// The creature's own, but where the scene tells otherwise.
void decide_self_contact(retarget::Wish wish, const TomlReader& root, double friction, retarget::Performer& performer) {
  physics::SelfContact& settings = performer.scene.self_contact;
  const std::optional<TomlReader> effects = root.table("effects");
  if (effects && effects->has("self_friction")) settings.friction = friction;
  if (wish == retarget::Wish::kOff) {
    settings = {};
    performer.self_contact_reason = "turned off by the scene";
  } else if (wish == retarget::Wish::kOn && !settings.is_on) {
    settings.is_on = true;
    settings.near_at_rest = kFarCells * performer.scene.body.rest_length.mean();
    performer.self_contact_reason = "asked for by the scene";
  }
}

std::vector<std::string> world_effects() {
  std::vector<std::string> names = retarget::switchable_effects();
  std::erase_if(names, [](const std::string& name) {
    return std::find(kBodyEffects.begin(), kBodyEffects.end(), name) != kBodyEffects.end();
  });
  return names;
}

/// Reads the world's part around its pivot. A creature keeps its level ground where the scene tells of none.
void read_world(const TomlReader& root, retarget::ScenarioOf<3>& scenario, retarget::World& world, std::vector<std::string>& warnings) {
  const physics::Ground own = scenario.scene.ground;
  scenario.origin = -world.pivot;
  read_surroundings<3>(root, scenario, warnings);
  read_pushes<3>(root, scenario);
  physics::Scene& scene = scenario.scene;
  const std::optional<TomlReader> ground = root.table("ground");
  scene.has_ground = true;
  if (!ground) scene.ground = own;
  if (ground) {
    if (!ground->has("friction")) scene.ground.friction = own.friction;
    world.turn = turn_to(scene.ground.normal);
    scene.ground.offset -= scene.ground.normal.dot(world.pivot);
    scene.ground.normal = Vector3d::UnitY();
    refuse_buried_start(root, scene.ground);
  }
  turn_surroundings(world, scenario);
  scenario.origin.setZero();
}

toml::array numbers_of(const auto& column) {
  toml::array numbers;
  for (const auto value : column) numbers.push_back(value);
  return numbers;
}

/// A mesh's file becomes its surface.
void write_out_mesh(const TomlReader& reader, toml::table& obstacle) {
  if (obstacle["shape"].value_or(std::string()) != "mesh" || !obstacle.contains("file")) return;
  std::vector<std::string> ignored;
  const physics::ClosedMeshOf<3> surface = surface_of<3>(reader, ignored);
  toml::array vertices, triangles;
  for (const auto vertex : surface.vertices().colwise()) vertices.push_back(numbers_of(vertex));
  for (const auto face : surface.faces().colwise()) triangles.push_back(numbers_of(face));
  obstacle.insert_or_assign("vertices_m", std::move(vertices));
  obstacle.insert_or_assign("triangles", std::move(triangles));
  obstacle.erase("file");
  obstacle.erase("scale");
}

}  // namespace

Vector3d scene_origin(const retarget::Performer& performer) {
  const Vector3d com = physics::centre_of_mass(performer.scene.body, retarget::undriven_scenario(performer).start.x);
  return {com.x(), 0, com.z()};
}

std::vector<std::string> put_in_scene(const std::filesystem::path& file, retarget::Performer& performer) {
  const toml::table table = parse_toml(file);
  const TomlReader root(table, file, "");
  refuse_what_is_not_of_the_world(root);
  std::vector<std::string> warnings;
  retarget::World world;
  retarget::ScenarioOf<3> scenario = retarget::undriven_scenario(performer);
  world.pivot = scene_origin(performer);
  read_world(root, scenario, world, warnings);
  auto [wishes, friction] = read_wished_effects(root, world_effects(), scenario.scene.ground.friction);
  const std::string broken = retarget::plan_effects<3>(wishes, scenario);
  if (!broken.empty()) throw root.refusal("effects", broken, "Add what it needs, or leave the effect to 'auto'.");
  refuse_swallowing(root, scenario);
  performer.scene = std::move(scenario.scene);
  if (performer.scene.water || performer.scene.air) retarget::fit_displacement(performer.skin, std::pow(performer.size, 3), performer.scene.body);
  decide_self_contact(wishes["self_contact"], root, friction, performer);
  world.moves = std::move(scenario.moves);
  world.pushes = std::move(scenario.pushes);
  world.decisions = std::move(scenario.decisions);
  performer.world = std::move(world);
  return warnings;
}

void put_in_own_scene(const std::filesystem::path& creature, retarget::Performer& performer) {
  const std::filesystem::path file = creature / kCreatureSceneFile;
  if (std::filesystem::exists(file)) put_in_scene(file, performer);
}

std::string creature_scene_text(const std::filesystem::path& file) {
  toml::table table = parse_toml(file);
  const TomlReader root(table, file, "");
  refuse_what_is_not_of_the_world(root);
  retarget::ScenarioOf<3> trial;
  std::vector<std::string> ignored;
  read_surroundings<3>(root, trial, ignored);
  read_pushes<3>(root, trial);
  read_wished_effects(root, world_effects(), 0);
  const std::vector<TomlReader> readers = root.tables("obstacle");
  for (std::size_t o = 0; o < readers.size(); ++o) write_out_mesh(readers[o], *table["obstacle"][o].as_table());
  table.insert_or_assign("schema", kSceneSchema);
  std::ostringstream text;
  text << "# The world that this creature is let go in. Written by hydrostat.\n" << table << "\n";
  return text.str();
}

}  // namespace hydrostat::io

#include "retarget/effects.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/elastic_forces.h"
#include "retarget/cpu_seconds.h"
#include "retarget/damping_seconds.h"
#include "retarget/performed_scenario.h"
#include "retarget/picture_effects.h"
#include "retarget/simulation.h"

namespace hydrostat::retarget {
namespace {

constexpr int kGroundSteps = 24;       // of one timing of the ground

physics::Body without_volume(const physics::Body& body) {
  physics::Body springs = body;
  springs.tets.resize(4, 0);
  springs.tet_edges.resize(6, 0);
  springs.rest_volume.resize(0);
  springs.volume_stiffness.resize(0);
  return springs;
}

/// Seconds per simulated second of a scene from the target's start.
double stepping_seconds(const physics::Scene& scene, const physics::State& start, const ReplayOptions& options) {
  const std::unique_ptr<physics::Stepper> stepper = physics::make_stepper(options.method, scene);
  physics::Impulses impulses = physics::make_impulses(scene);
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(scene.body.edge_count());
  physics::State state = start;
  const auto step = [&] { stepper->step(options.step_s, passive, nullptr, state, impulses); };
  step();  // looks for what may touch for the first time: that is no running cost
  const double began = thread_seconds();
  for (int k = 0; k < kGroundSteps; ++k) step();
  return (thread_seconds() - began) / (kGroundSteps * options.step_s);
}

/// What `more` of a scene costs: the difference to `less` of it.
double seconds_between(const physics::Scene& more, const physics::Scene& less, const physics::State& start, const ReplayOptions& options) {
  std::array<double, kTimings> differences;
  for (double& difference : differences) {
    difference = stepping_seconds(more, start, options) - stepping_seconds(less, start, options);
  }
  return std::max(0.0, median(differences));
}

double ground_seconds(const physics::Scene& scene, const physics::State& start, const ReplayOptions& options) {
  physics::Scene free_fall = scene;
  free_fall.has_ground = false;
  return seconds_between(scene, free_fall, start, options);
}

double self_contact_seconds(const physics::Scene& scene, const physics::State& start, const ReplayOptions& options) {
  physics::Scene without = scene;
  without.self_contact = {};
  return seconds_between(scene, without, start, options);
}

EffectReport embedding_of(const Performer& performer) {
  return {"embedding", "on", "the skin follows the nodes of its tets; counted at 60 frames a second, outside the solver",
          embedding_ms_per_sim_s(performer)};
}

EffectReport wobble_of(const Performer& performer) {
  return {"wobble", performer.wobble.is_on() ? "on" : "off", performer.wobble.reason, wobble_ms_per_sim_s(performer)};
}

/// Of a creature in a scene: what that decided, timed as a scene's effects are.
std::vector<EffectReport> effects_in_world(const Performer& performer, const ReplayOptions& options) {
  ScenarioOf<3> scenario = undriven_scenario(performer);
  scenario.pushes.insert(scenario.pushes.end(), options.pushes.begin(), options.pushes.end());
  SimulationOptions simulation;
  simulation.method = options.method;
  simulation.dt_s = options.step_s;
  std::vector<EffectReport> effects = effects_of(scenario, simulation);
  for (EffectReport& effect : effects) {
    if (effect.name == "embedding") effect = embedding_of(performer);
    if (effect.name == "wobble") effect = wobble_of(performer);
    if (effect.name == "fracture") effect.reason = "a creature has no seams; scenes have [[seam]]";
    if (effect.name == "pushes" && !options.pushes.empty()) effect.reason = "asked for by --push";
  }
  return effects;
}

}  // namespace

std::vector<EffectReport> effects_of(const Performer& performer, const ReplayOptions& options) {
  if (performer.world.is_told()) return effects_in_world(performer, options);
  const physics::Body& body = performer.scene.body;
  const double substeps = std::round(options.step_s / physics::make_stepper(options.method, performer.scene)->substep(options.step_s));
  const double passes = substeps / options.step_s;  // over the body, per simulated second
  physics::State state;
  MotionCurve(performer.prepared.target).at(0, state.x, state.v);
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(body.edge_count());
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, body.node_count());
  const physics::Body springs = without_volume(body);
  const auto ms = [](double seconds_per_second) { return 1e3 * seconds_per_second; };
  const bool has_elements = !body.elements.empty();  // volume is then a part of their law
  const double elastic = has_elements ? 0 : seconds_of([&] { physics::add_elastic_forces(body, state.x, passive, force); });
  const double edges_alone =
      has_elements ? 0 : seconds_of([&] { physics::add_elastic_forces(springs, state.x, passive, force); });
  const double damping = damping_seconds(performer.scene, options.method, options.step_s, state);
  const double gravity = seconds_of([&] { force.colwise() += performer.scene.gravity; });
  const bool pushed = !options.pushes.empty(), touches_itself = performer.scene.self_contact.is_on;
  const double pushing = pushed ? seconds_of([&] { force += state.v; }) : 0;

  return {
      {"gravity", "on", "9.81 m/s2 downward; timed as a pass over the nodes of its own", ms(gravity * passes)},
      {"ground", "on",
       "the target stands and lands on it; friction is solved in the same pass and its cost is in this figure",
       ms(ground_seconds(performer.scene, state, options))},
      {"friction", "on", "feet hold by it; its cost cannot be told from the ground's and is counted there", 0},
      {"obstacles", "off", "there is nothing but the ground", 0},
      {"self_contact", touches_itself ? "on" : "off", performer.self_contact_reason,
       touches_itself ? ms(self_contact_seconds(performer.scene, state, options)) : 0},
      {"volume", "on",
       has_elements ? "a part of the elements' law, as far as Poisson's ratio says; counted there"
                    : "the body keeps the volume of each tet by a spring",
       ms(std::max(0.0, elastic - edges_alone) * passes)},
      {"damping", "on", "a dashpot along every constraint; timed by itself",
       ms(damping * passes)},
      {"air_drag", "off", "a creature moves in still air without drag; scenes have [air]", 0},
      {"water", "off", "there is no water", 0},
      {"pushes", pushed ? "on" : "off", pushed ? "asked for by --push" : "none was asked for", ms(pushing * passes)},
      embedding_of(performer),
      wobble_of(performer),
      {"fracture", "off", "a creature has no seams; scenes have [[seam]]", 0},
  };
}

}  // namespace hydrostat::retarget

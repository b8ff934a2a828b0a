#include <algorithm>
#include <cmath>
#include <cstdio>

#include "physics/elastic_forces.h"
#include "retarget/cpu_seconds.h"
#include "retarget/simulation.h"

namespace hydrostat::retarget {
namespace {

constexpr int kContactSteps = 12;  // of one timing of the contact

template <int Dim>
double stepping_seconds(const physics::SceneOf<Dim>& scene, const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  const std::unique_ptr<physics::StepperOf<Dim>> stepper = physics::make_stepper(options.method, scene);
  physics::ImpulsesOf<Dim> impulses = physics::make_impulses(scene);
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(scene.body.edge_count());
  physics::StateOf<Dim> state = scenario.start;
  const double began = thread_seconds();
  for (int k = 0; k < kContactSteps; ++k) stepper->step(options.dt_s, passive, nullptr, state, impulses);
  return (thread_seconds() - began) / (kContactSteps * options.dt_s);
}

/// What `more` of the scene costs, seconds per simulated second from the start on: the difference to `less` of it.
template <int Dim>
double seconds_between(const physics::SceneOf<Dim>& more, const physics::SceneOf<Dim>& less, const ScenarioOf<Dim>& scenario,
                       const SimulationOptions& options) {
  std::array<double, kTimings> differences;
  for (double& difference : differences) {
    difference = stepping_seconds(more, scenario, options) - stepping_seconds(less, scenario, options);
  }
  return std::max(0.0, median(differences));
}

/// What it costs to have the surroundings.
template <int Dim>
double contact_seconds(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  physics::SceneOf<Dim> empty = scenario.scene;
  empty.has_ground = false;
  empty.obstacles.clear();
  return seconds_between(scenario.scene, empty, scenario, options);
}

template <int Dim>
double self_contact_seconds(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  physics::SceneOf<Dim> without = scenario.scene;
  without.self_contact = {};
  return seconds_between(scenario.scene, without, scenario, options);
}

/// The elastic forces' cost with and without volumes.
template <int Dim, typename Timing>
double ms_of_volume(const physics::BodyOf<Dim>& body, const physics::StateOf<Dim>& state, const Eigen::VectorXd& activation,
                    const Timing& ms_of) {
  physics::BodyOf<Dim> springs = body;
  springs.tets.resize(Dim + 1, 0);
  springs.tet_edges.resize(physics::kEdgesPerTet<Dim>, 0);
  springs.rest_volume.resize(0);
  springs.volume_stiffness.resize(0);
  physics::PointsOf<Dim> force = state.v;
  const double all = ms_of([&] { physics::add_elastic_forces(body, state.x, activation, force); });
  return std::max(0.0, all - ms_of([&] { physics::add_elastic_forces(springs, state.x, activation, force); }));
}

std::string many(std::size_t count, const char* one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

}  // namespace

template <int Dim>
std::vector<EffectReport> effects_of(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const physics::BodyOf<Dim>& body = scene.body;
  const physics::StateOf<Dim> state{body.rest, physics::PointsOf<Dim>::Zero(Dim, body.node_count())};
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(body.edge_count());
  physics::PointsOf<Dim> force = physics::PointsOf<Dim>::Zero(Dim, body.node_count());
  const double passes = 1 / physics::make_stepper(options.method, scene)->substep(options.dt_s);
  const auto ms_of = [&](const auto& work) { return 1000 * passes * seconds_of(work); };

  const bool has_volume_springs = body.volume_stiffness.size() > 0;
  const double volume = has_volume_springs ? ms_of_volume(body, state, passive, ms_of) : 0;
  const bool has_gravity = scene.gravity.norm() > 0, has_damping = body.edge_damping.maxCoeff() > 0;
  const bool has_friction = (scene.has_ground && scene.ground.friction > 0) ||
                            std::any_of(scene.obstacles.begin(), scene.obstacles.end(), [](const auto& o) { return o.friction > 0; });
  const bool touches = scene.has_ground || !scene.obstacles.empty();
  const double contact = touches ? 1000 * contact_seconds(scenario, options) : 0;
  const double gravity = has_gravity ? ms_of([&] { force.colwise() += scene.gravity; }) : 0;
  const double damping = has_damping ? ms_of([&] { physics::add_damping_forces(body, state.x, state.v, force); }) : 0;
  const bool pushed = !scenario.pushes.empty(), touches_itself = scene.self_contact.is_on;
  const double pushing = pushed ? ms_of([&] { force += state.v; }) : 0;
  char pull[60];
  std::snprintf(pull, sizeof pull, "%.3g m/s2; timed as a pass over the nodes of its own", scene.gravity.norm());
  const std::string in_ground = scene.has_ground ? "counted with the ground's contact" : "the cost is that of all contact";
  const auto state_of = [](bool is_on) { return is_on ? "on" : "off"; };
  return {
      {"gravity", state_of(has_gravity), has_gravity ? pull : "the scene has none", gravity},
      {"ground", state_of(scene.has_ground),
       scene.has_ground ? "the scene has one; the cost is that of all contact" : "the scene has none", scene.has_ground ? contact : 0},
      {"friction", state_of(has_friction), has_friction ? "solved with the contact and counted there" : "nothing rubs", 0},
      {"obstacles", state_of(!scene.obstacles.empty()),
       scene.obstacles.empty() ? "the scene has none" : many(scene.obstacles.size(), "obstacle") + " in the scene; " + in_ground,
       scene.has_ground ? 0 : contact},
      {"self_contact", state_of(touches_itself), scenario.self_contact_reason + (touches_itself ? "; timed from the start" : ""),
       touches_itself ? 1000 * self_contact_seconds(scenario, options) : 0},
      {"volume", "on",
       has_volume_springs ? "every element keeps its volume by a spring" : "a part of the elements' law, as far as Poisson's ratio says; counted there",
       volume},
      {"damping", state_of(has_damping),
       has_damping ? "a dashpot along every constraint; timed as a pass over the constraints of its own" : "damping_time_s is 0", damping},
      {"air_drag", "off", "not simulated in this version", 0},
      {"water", "off", "there is no water", 0},
      {"pushes", state_of(pushed), pushed ? std::to_string(scenario.pushes.size()) + " in the scene" : "the scene has none", pushing},
      {"embedding", "off", "the skin is the mesh's own surface", 0},
      {"wobble", "off", "not simulated in this version: the skin has no motion of its own", 0},
      {"fracture", "off", "not simulated in this version: the body does not tear", 0},
  };
}
template std::vector<EffectReport> effects_of<2>(const ScenarioOf<2>&, const SimulationOptions&);
template std::vector<EffectReport> effects_of<3>(const ScenarioOf<3>&, const SimulationOptions&);

}  // namespace hydrostat::retarget

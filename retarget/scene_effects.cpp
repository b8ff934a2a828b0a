#include <algorithm>
#include <cmath>

#include "physics/elastic_forces.h"
#include "physics/fluid.h"
#include "physics/tearing.h"
#include "retarget/cpu_seconds.h"
#include "retarget/damping_seconds.h"
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
  const auto step = [&] { stepper->step(options.dt_s, passive, nullptr, state, impulses); };
  step();  // looks for what may touch for the first time: that is no running cost
  const double began = thread_seconds();
  for (int k = 0; k < kContactSteps; ++k) step();
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

/// The same of the parts of a body that can split, all of them apart and as they lie at the start.
template <int Dim>
double parts_contact_seconds(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  return self_contact_seconds(written_scenario(scenario), options);
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

/// Of the whole body.
template <int Dim>
double ms_of_fracture(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  if (!scenario.fracture) return 0;
  const physics::BodyOf<Dim>& body = scenario.scene.body;
  const std::vector<char> is_broken(scenario.fracture->faces.size(), 0);
  const physics::SplitMesh<Dim> apart =
      physics::split_mesh(scenario.fracture->mesh, scenario.fracture->faces, std::vector<char>(is_broken.size(), 1));
  physics::SeamWatch<Dim> watch(*scenario.fracture, body, apart, options.method == physics::Method::kSpring);
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(body.edge_count());
  return 1000 / options.dt_s * seconds_of([&] { watch.tensions(body.rest, passive, is_broken); });
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
  const bool has_damping = body.edge_damping.maxCoeff() > 0, pushed = !scenario.pushes.empty(), touches_itself = scene.self_contact.is_on;
  const bool has_friction = (scene.has_ground && scene.ground.friction > 0) ||
                            std::any_of(scene.obstacles.begin(), scene.obstacles.end(), [](const auto& o) { return o.friction > 0; });
  const bool touches = scene.has_ground || !scene.obstacles.empty();
  const double contact = touches ? 1000 * contact_seconds(scenario, options) : 0;
  const auto cost_of_fluid = [&](const std::optional<physics::FluidOf<Dim>>& fluid) {
    if (!fluid) return 0.0;
    physics::FluidEffect<Dim> effect(scene, *fluid);
    return 1000 / options.dt_s * seconds_of([&] { effect.add_forces(options.dt_s, state, force); });
  };
  std::vector<EffectReport> effects;
  // What the plan decided, or, of a scenario that nobody planned, what it has; and what the cost is of.
  const auto tell = [&](const char* name, bool is_on, const char* otherwise, const std::string& costs, double ms) {
    EffectReport effect{name, is_on ? "on" : "off", is_on ? "the scene has it" : otherwise, ms};
    for (const EffectDecision& decision : scenario.decisions) {
      if (decision.name == name) effect.reason = decision.reason;
    }
    if (is_on && !costs.empty()) effect.reason += "; " + costs;
    effects.push_back(std::move(effect));
  };
  tell("gravity", scene.gravity.norm() > 0, "the scene has none", "timed as a pass over the nodes of its own",
       scene.gravity.norm() > 0 ? ms_of([&] { force.colwise() += scene.gravity; }) : 0);
  tell("ground", scene.has_ground, "the scene has none", "the cost is that of all contact", scene.has_ground ? contact : 0);
  tell("friction", has_friction, "nothing rubs", "solved with the contact and counted there", 0);
  tell("obstacles", !scene.obstacles.empty(), "the scene has none",
       scene.has_ground ? "counted with the ground's contact" : "the cost is that of all contact", scene.has_ground ? 0 : contact);
  const bool parts_touch = !touches_itself && scenario.fracture && scenario.fracture->self_contact.is_on;
  const double itself = touches_itself ? self_contact_seconds(scenario, options) : parts_touch ? parts_contact_seconds(scenario, options) : 0;
  effects.push_back({"self_contact", touches_itself || parts_touch ? "on" : "off",
                     scenario.self_contact_reason + (touches_itself ? "; timed from the start" : parts_touch ? ", timed with all of them apart" : ""),
                     1000 * itself});
  tell("volume", has_volume_springs || !body.elements.empty(), "nothing keeps volume", "",
       has_volume_springs ? ms_of_volume(body, state, passive, ms_of) : 0);
  tell("damping", has_damping, "damping_time_s is 0", "timed by itself",
       has_damping ? 1000 * passes * damping_seconds(scene, options.method, options.dt_s, state) : 0);
  tell("air_drag", scene.air.has_value(), "the scene tells of no air", "one pass over the surface a step", cost_of_fluid(scene.air));
  tell("water", scene.water.has_value(), "there is no water", "buoyancy and drag, one pass over the surface a step",
       cost_of_fluid(scene.water));
  tell("pushes", pushed, "the scene has none", "", pushed ? ms_of([&] { force += state.v; }) : 0);
  tell("embedding", false, "the skin is the mesh's own surface", "", 0);
  tell("wobble", false, "of creatures alone: what is seen of a scene are its nodes", "", 0);
  tell("fracture", scenario.fracture.has_value(), "no seam is marked", "one pass over what touches the seams a step",
       ms_of_fracture(scenario, options));
  return effects;
}
template std::vector<EffectReport> effects_of<2>(const ScenarioOf<2>&, const SimulationOptions&);
template std::vector<EffectReport> effects_of<3>(const ScenarioOf<3>&, const SimulationOptions&);

}  // namespace hydrostat::retarget

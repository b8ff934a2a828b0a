#include "retarget/level_cost.h"

#include <algorithm>
#include <cmath>

#include "retarget/simulation.h"
#include "retarget/step_cost.h"

namespace hydrostat::retarget {

double frame_work_ms(const physics::Scene& scene, Eigen::Index muscles, const ReplayOptions& options) {
  constexpr double kFrame = 1.0 / 60, kSettling = 0.1;  // [s]
  ScenarioOf<3> scenario;
  scenario.scene = scene;
  scenario.start = {scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count()), {}};
  SimulationOptions simulation;
  simulation.method = options.method;
  simulation.dt_s = options.step_s;
  simulation.duration_s = options.step_s * std::ceil(kSettling / options.step_s);
  simulation.figures = false;
  const Simulation run = simulate(scenario, simulation);
  const double corrections = options.correct ? kFrame / (options.step_s * options.steps_per_control) : 0;
  const double steps = std::round(simulation.duration_s / simulation.dt_s);
  return counted_ms(scene, options.method, true, steps, run.work) / simulation.duration_s * kFrame +
         corrections * counted_ms_of_correction(scene, muscles);
}

std::vector<LevelCost> level_costs(const Performer& solved, const Rig& rig, const CreatureOptions& options,
                                   const ReplayOptions& replay) {
  constexpr int kFewest = 20;
  std::vector<LevelCost> costs;
  for (const double factor : {4.0, 2.0, 1.0, 0.5, 0.25, 0.125}) {
    const Eigen::Index muscles = solved.muscles.fields.cols();
    LevelCost cost{0, solved.mesh.node_count(), 0};
    if (factor == 1) {
      cost.work_ms = frame_work_ms(solved.scene, muscles, replay);
    } else {
      cost.wished = std::max(kFewest, static_cast<int>(std::lround(factor * cost.nodes)));
      const Creature creature = level_body(rig, options, cost.wished);
      cost.nodes = creature.mesh.node_count();
      cost.work_ms = frame_work_ms(creature.scene, muscles, replay);
    }
    if (costs.empty() || cost.nodes < costs.back().nodes) costs.push_back(cost);
  }
  return costs;
}

}  // namespace hydrostat::retarget

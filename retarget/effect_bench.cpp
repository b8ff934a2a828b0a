#include "retarget/effect_bench.h"

#include <algorithm>
#include <cmath>

#include "retarget/effect_plan.h"

namespace hydrostat::retarget {
namespace {

constexpr int kRepeats = 3;  // the best of which counts
const std::string kSelfContact = "self_contact", kFracture = "fracture";

/// `kept`: the one effect that stays, of those that can be switched; empty: none.
template <int Dim>
ScenarioOf<Dim> with_only(const ScenarioOf<Dim>& scenario, const std::string& kept) {
  ScenarioOf<Dim> result = scenario;
  std::map<std::string, Wish> wishes;
  for (const std::string& name : switchable_effects()) {
    if (name != kept && (name != "volume" || scenario.scene.body.volume_stiffness.size() > 0)) wishes[name] = Wish::kOff;
  }
  if (kept == kFracture) wishes[kept] = Wish::kOn;  // alone nothing may load the seams: what the watch costs is told all the same
  plan_effects(wishes, result);
  if (kept != kSelfContact) result.scene.self_contact = {};
  if (kept != kSelfContact && result.fracture) result.fracture->self_contact = {};
  return result;
}

template <int Dim>
Simulation best_of(const ScenarioOf<Dim>& scenario, SimulationOptions options) {
  options.figures = options.trace = false;
  Simulation best = simulate(scenario, options);
  for (int k = 1; k < kRepeats; ++k) {
    Simulation next = simulate(scenario, options);
    if (next.report.ms_per_sim_s < best.report.ms_per_sim_s) best = std::move(next);
  }
  return best;
}

}  // namespace

template <int Dim>
std::vector<EffectRow> measure_effects(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  const Simulation none = best_of(with_only(scenario, ""), options);
  std::vector<EffectRow> rows{{"none", none.report.ms_per_sim_s, 0, !none.report.diverged, none.report.guard_steps}};
  const auto add = [&](const std::string& name, const ScenarioOf<Dim>& with) {
    const Simulation run = best_of(with, options);
    const Eigen::Index frames = std::min(run.motion.count(), none.motion.count());
    const Eigen::Index nodes = scenario.scene.body.node_count();  // before copies of them, where the body splits
    const double count = static_cast<double>(frames * nodes);
    const double squared = (run.motion.frames.topLeftCorner(3 * nodes, frames) - none.motion.frames.topLeftCorner(3 * nodes, frames)).squaredNorm();
    rows.push_back({name, run.report.ms_per_sim_s, std::sqrt(squared / count) / scenario.length, !run.report.diverged,
                    run.report.guard_steps});
  };
  for (const EffectDecision& decision : scenario.decisions) {
    const bool is_law = decision.name == "volume" && scenario.scene.body.volume_stiffness.size() == 0;
    if (decision.is_on && !is_law) add(decision.name, with_only(scenario, decision.name));
  }
  if (scenario.scene.self_contact.is_on) add(kSelfContact, with_only(scenario, kSelfContact));
  add("all", scenario);
  return rows;
}
template std::vector<EffectRow> measure_effects<2>(const ScenarioOf<2>&, const SimulationOptions&);
template std::vector<EffectRow> measure_effects<3>(const ScenarioOf<3>&, const SimulationOptions&);

}  // namespace hydrostat::retarget

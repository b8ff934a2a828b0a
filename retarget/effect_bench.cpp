#include "retarget/effect_bench.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "retarget/effect_plan.h"
#include "retarget/picture_effects.h"

namespace hydrostat::retarget {
namespace {

constexpr int kRepeats = 3;  // the best of which counts
const std::string kSelfContact = "self_contact";

/// Effects of the scenario that are on and can be off.
template <int Dim>
std::vector<std::string> switched(const ScenarioOf<Dim>& scenario) {
  std::vector<std::string> names;
  for (const EffectDecision& decision : scenario.decisions) {
    const bool is_law = decision.name == "volume" && scenario.scene.body.volume_stiffness.size() == 0;
    if (decision.is_on && !is_law) names.push_back(decision.name);
  }
  if (scenario.scene.self_contact.is_on) names.push_back(kSelfContact);
  return names;
}

/// Of those that can be switched `kept` are on, needed or not, and all others off.
template <int Dim>
ScenarioOf<Dim> with_only(const ScenarioOf<Dim>& scenario, const std::vector<std::string>& kept) {
  const auto is_kept = [&](const std::string& name) { return std::find(kept.begin(), kept.end(), name) != kept.end(); };
  ScenarioOf<Dim> result = scenario;
  std::map<std::string, Wish> wishes;
  for (const std::string& name : switchable_effects()) {
    if (name != "volume" || scenario.scene.body.volume_stiffness.size() > 0) wishes[name] = is_kept(name) ? Wish::kOn : Wish::kOff;
  }
  plan_effects(wishes, result);
  if (!is_kept(kSelfContact)) {
    result.scene.self_contact = {};
    if (result.fracture) result.fracture->self_contact = {};
  }
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

/// What is seen of a motion: places 3P x F.
using Seen = std::function<Eigen::MatrixXd(const Motion&)>;

/// RMS over points and the frames that both have [m].
double apart(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::Index frames = std::min(a.cols(), b.cols());
  const double count = static_cast<double>(frames * (a.rows() / 3));
  return std::sqrt((a.leftCols(frames) - b.leftCols(frames)).squaredNorm() / count);
}

/// Rows of the body's own effects, "none" first and "all" last; `none` and `all` receive their motions.
template <int Dim>
std::vector<EffectRow> rows_of_body(const ScenarioOf<Dim>& scenario, const SimulationOptions& options, const Seen& seen, Motion& none,
                                    Motion& all) {
  const Simulation bare = best_of(with_only(scenario, {}), options), whole = best_of(scenario, options);
  none = bare.motion;
  all = whole.motion;
  const Eigen::MatrixXd seen_none = seen(none), seen_all = seen(all);
  const auto row = [&](const std::string& name, const Simulation& alone, const Simulation& without) {
    return EffectRow{name,
                     alone.report.ms_per_sim_s,
                     apart(seen(alone.motion), seen_none) / scenario.length,
                     !alone.report.diverged,
                     alone.report.guard_steps,
                     without.report.ms_per_sim_s,
                     apart(seen(without.motion), seen_all) / scenario.length};
  };
  std::vector<EffectRow> rows{row("none", bare, whole)};
  const std::vector<std::string> names = switched(scenario);
  for (const std::string& name : names) {
    std::vector<std::string> others = names;
    std::erase(others, name);
    rows.push_back(row(name, best_of(with_only(scenario, {name}), options), best_of(with_only(scenario, others), options)));
  }
  rows.push_back(row("all", whole, bare));
  return rows;
}

}  // namespace

template <int Dim>
std::vector<EffectRow> measure_effects(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  const Eigen::Index nodes = scenario.scene.body.node_count();  // before copies of them, where the body splits
  Motion none, all;
  return rows_of_body<Dim>(scenario, options, [&](const Motion& motion) { return motion.frames.topRows(3 * nodes).eval(); }, none, all);
}
template std::vector<EffectRow> measure_effects<2>(const ScenarioOf<2>&, const SimulationOptions&);
template std::vector<EffectRow> measure_effects<3>(const ScenarioOf<3>&, const SimulationOptions&);

std::vector<EffectRow> measure_effects(const Performer& performer, const ScenarioOf<3>& scenario, const SimulationOptions& options) {
  const Seen skin = [&](const Motion& motion) { return embedded_motion(performer, motion); };
  Motion none, all;
  std::vector<EffectRow> rows = rows_of_body<3>(scenario, options, skin, none, all);
  const Eigen::MatrixXd skin_none = skin(none), skin_all = skin(all), wobbled = wobbled_motion(performer, all);
  const double embedding_ms = embedding_ms_per_sim_s(performer), wobble_ms = wobble_ms_per_sim_s(performer), length = performer.length;
  EffectRow whole = rows.back();
  rows.pop_back();
  for (EffectRow& row : rows) row.without_ms_per_sim_s += embedding_ms + wobble_ms;
  const double body_ms = whole.ms_per_sim_s, none_ms = rows.front().ms_per_sim_s;
  const auto add = [&](const std::string& name, double ms, double alone, double without) {
    EffectRow row = rows.front();  // the body moves as without any
    row.effect = name;
    row.ms_per_sim_s = none_ms + ms;
    row.difference_length = alone / length;
    row.without_ms_per_sim_s = body_ms + embedding_ms + wobble_ms - ms;
    row.without_difference_length = without / length;
    rows.push_back(row);
  };
  const auto stands = [](const Eigen::MatrixXd& moving) { return moving.col(0).replicate(1, moving.cols()).eval(); };
  add("embedding", embedding_ms, apart(skin_none, stands(skin_none)), apart(wobbled, stands(skin_all)));
  if (performer.wobble.is_on()) add("wobble", wobble_ms, apart(wobbled_motion(performer, none), skin_none), apart(wobbled, skin_all));
  whole.ms_per_sim_s += embedding_ms + wobble_ms;
  whole.difference_length = whole.without_difference_length = apart(wobbled, skin_none) / length;
  rows.push_back(whole);
  return rows;
}

}  // namespace hydrostat::retarget

#include "cli/level_trial.h"

#include <algorithm>
#include <cstdio>

namespace hydrostat::cli {
namespace {

constexpr double kMostWork = 60;   // [s] of counted work, all replays together
constexpr double kFrameHz = 60;    // that a level's cost is told for
constexpr double kHeadroom = 1.1;  // of a budget over the cost of the level that it is for

bool is_cheaper(const retarget::LevelCost& a, const retarget::LevelCost& b) { return a.work_ms < b.work_ms; }

std::string of_nodes(const std::vector<int>& nodes) {
  std::string text = "of ";
  for (std::size_t k = 0; k < nodes.size(); ++k) text += (k == 0 ? "" : k + 1 < nodes.size() ? ", " : " and ") + std::to_string(nodes[k]);
  return text + " nodes";
}

std::string cost_of(const retarget::LevelCost& cost) {
  char text[80];
  std::snprintf(text, sizeof text, "of %d nodes, takes %.3g ms", cost.nodes, cost.work_ms);
  return text;
}

}  // namespace

LevelTrial try_levels(std::vector<retarget::LevelCost> levels, double above_ms, int own_nodes, double duration_s,
                      const std::function<bool(const retarget::LevelCost&)>& keeps_way) {
  std::sort(levels.begin(), levels.end(), is_cheaper);
  LevelTrial trial;
  double work = 0;
  for (const retarget::LevelCost& level : levels) {
    if (level.work_ms <= above_ms || level.nodes > own_nodes) continue;
    work += 1e-3 * level.work_ms * kFrameHz * duration_s;
    if (work > kMostWork) break;
    if (keeps_way(level)) {
      trial.found = level;
      break;
    }
    trial.lost.push_back(level.nodes);
  }
  return trial;
}

std::string budget_for(const retarget::LevelCost& cost) {
  char text[40];
  std::snprintf(text, sizeof text, "%.2gms", kHeadroom * cost.work_ms);
  return text;
}

UsageError no_level_within(const std::string& command, double budget_ms, const std::vector<retarget::LevelCost>& levels,
                           const LevelTrial& trial) {
  char least[80];
  std::snprintf(least, sizeof least, "no level takes %.3g ms a frame or less; the cheapest", budget_ms);
  if (trial.found) {
    return {command, "option --budget", std::string(least) + " on which the creature keeps its way, " + cost_of(*trial.found),
            "Allow " + budget_for(*trial.found) + "."};
  }
  const retarget::LevelCost& cheapest = *std::min_element(levels.begin(), levels.end(), is_cheaper);
  std::string known = "; whether the creature keeps its way on any is not known: a replay of each would take too long";
  if (!trial.lost.empty()) known = "; on those " + of_nodes(trial.lost) + " the creature falls or gets nowhere, and on finer ones it is not known";
  return {command, "option --budget", std::string(least) + ", " + cost_of(cheapest) + known, "Allow " + budget_for(cheapest) + " or more."};
}

std::string way_up(const LevelTrial& trial, bool by_budget) {
  if (!trial.found) {
    if (trial.lost.empty()) return "";
    return "it falls or gets nowhere on levels " + of_nodes(trial.lost) + ", too: convert again with more --nodes or a calmer clip";
  }
  const int nodes = trial.found->wished > 0 ? trial.found->wished : trial.found->nodes;
  const std::string option = by_budget ? "--budget " + budget_for(*trial.found) : "--lod " + std::to_string(nodes);
  return "the cheapest level on which it keeps its way, " + cost_of(*trial.found) + " a frame: give " + option;
}

}  // namespace hydrostat::cli

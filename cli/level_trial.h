#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "retarget/error.h"
#include "retarget/level_cost.h"

namespace hydrostat::cli {

/// What was found by replaying levels of a creature, the cheapest first.
struct LevelTrial {
  std::optional<retarget::LevelCost> found;  // the first that keeps feet and way
  std::vector<int> lost;                     // nodes of those before it, on which the creature falls or gets nowhere
};

/// Replays the levels that cost more than `above_ms`, but are no finer than the creature's own of `own_nodes`, until one keeps its way or
/// the counted work of the next would make more than a minute in all. keeps_way tells it of one; a replay lasts duration_s.
LevelTrial try_levels(std::vector<retarget::LevelCost> levels, double above_ms, int own_nodes, double duration_s,
                      const std::function<bool(const retarget::LevelCost&)>& keeps_way);

/// A budget [ms] that allows a level, as the option --budget has it.
std::string budget_for(const retarget::LevelCost& cost);

/// Of a budget that no level meets: names the cheapest of `levels` that is known to keep its way, or says that none is.
UsageError no_level_within(const std::string& command, double budget_ms, const std::vector<retarget::LevelCost>& levels,
                           const LevelTrial& trial);

/// What to do where the level that was taken is down: end of a sentence. Empty where no other was tried.
std::string way_up(const LevelTrial& trial, bool by_budget);

}  // namespace hydrostat::cli

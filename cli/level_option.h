#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "io/load_creature.h"
#include "retarget/level_cost.h"

namespace hydrostat::cli {

/// What --lod and --budget ask for.
struct AskedLevel {
  std::string lod;     // a number of nodes, "auto", or empty
  std::string budget;  // "2ms" of processor time, counted, for a frame of 1/60 s

  bool is_asked() const { return !lod.empty(); }
};

/// Adds both options.
void add_level_options(CLI::App& app, AskedLevel& asked);

/// The budget for a frame [ms], 0 for none. Throws UsageError for what is no time.
double budget_ms(const AskedLevel& asked, const std::string& command);

/// The levels of a creature that are asked among, the finest first: one number of nodes, whose cost is not told, or for auto those that
/// there are, each with its cost. Throws UsageError for what is no number of nodes or no budget.
std::vector<retarget::LevelCost> levels_asked_among(const AskedLevel& asked, const std::string& command,
                                                    const io::LoadedCreature& creature, const retarget::Rig& rig,
                                                    const retarget::ReplayOptions& replay);

/// Of these levels those that the budget allows; all where there is no budget.
std::vector<retarget::LevelCost> levels_within(const std::vector<retarget::LevelCost>& levels, const AskedLevel& asked,
                                               const std::string& command);

/// The warning of a control mesh that has more than 1.5 times the nodes that were wished for, or less than 1 / 1.5 of them; else empty.
std::string far_from_wish(int wished, int nodes);

/// The creature at a level, in the place of the solved one, and what its report tells of it.
io::LoadedCreature at_level(const io::LoadedCreature& creature, const retarget::Rig& rig, const retarget::LevelCost& cost,
                            const AskedLevel& asked, const std::string& command);

}  // namespace hydrostat::cli

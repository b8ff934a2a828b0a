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

/// The levels of a creature that were asked for, the finest first: one number of nodes, or those that the budget allows.
/// Throws UsageError, which tells what is possible, for a budget that no level meets.
std::vector<retarget::LevelCost> levels_within(const AskedLevel& asked, const std::string& command,
                                               const io::LoadedCreature& creature, const retarget::Rig& rig,
                                               const retarget::ReplayOptions& replay);

/// The creature at a level, in the place of the solved one, and what its report tells of it.
io::LoadedCreature at_level(const io::LoadedCreature& creature, const retarget::Rig& rig, const retarget::LevelCost& cost,
                            const AskedLevel& asked, const std::string& command);

}  // namespace hydrostat::cli

#include "cli/level_option.h"

#include <cmath>
#include <cstdio>

#include "cli/asked_accuracy.h"
#include "cli/number_option.h"
#include "retarget/error.h"

namespace hydrostat::cli {
namespace {

constexpr const char* kAuto = "auto";
constexpr double kFewest = 20, kMost = 5000;              // nodes
constexpr double kLeastBudget = 1e-3, kMostBudget = 1e5;  // [ms]
constexpr double kFarOff = 1.5;                           // of a wish, or the wish of it [-]

}  // namespace

double budget_ms(const AskedLevel& asked, const std::string& command) {
  if (asked.budget.empty()) return 0;
  return parse_milliseconds(asked.budget, kLeastBudget, kMostBudget, command, "--budget");
}

std::string far_from_wish(int wished, int nodes) {
  if (nodes <= kFarOff * wished && wished <= kFarOff * nodes) return "";
  char text[160];
  std::snprintf(text, sizeof text, "level: the control mesh has %d nodes where --lod asks for %d, for its lattice goes by whole cells", nodes, wished);
  return text;
}

void add_level_options(CLI::App& app, AskedLevel& asked) {
  CLI::Option* lod = app.add_option(
      "--lod", asked.lod,
      "Replay on another control mesh of about so many nodes, 20 to 5000, by a plan of its own with the same edits; auto: the "
      "finest of an eighth, a quarter, half, one, two and four times the creature's that --budget allows and that keeps its way");
  lod->check(refuse_empty);
  app.add_option("--budget", asked.budget,
                 "2ms: processor time of solver and corrector that a frame of 1/60 s may take, by counted work")
      ->needs(lod);
}

std::vector<retarget::LevelCost> levels_asked_among(const AskedLevel& asked, const std::string& command,
                                                    const io::LoadedCreature& creature, const retarget::Rig& rig,
                                                    const retarget::ReplayOptions& replay) {
  const retarget::Performer& performer = creature.target.performer;
  const double budget = budget_ms(asked, command);
  if (asked.lod != kAuto) {
    if (budget > 0) {
      throw UsageError(command, "option --budget", "is for --lod auto, and --lod tells a number of nodes",
                       "Leave one of them out.");
    }
    const double nodes = parse_number(asked.lod, kFewest, kMost, command, "--lod");
    if (nodes != std::floor(nodes)) {
      throw UsageError(command, "option --lod", "'" + asked.lod + "' is no whole number", "Nodes come whole.");
    }
    retarget::LevelCost cost;
    if (nodes != performer.mesh.node_count()) cost.wished = static_cast<int>(nodes);  // else the creature itself
    return {cost};
  }
  if (budget == 0) {
    throw UsageError(command, "option --lod", "auto goes by a budget, and there is none", "Give --budget 2ms, say.");
  }
  return retarget::level_costs(performer, rig, io::level_options(creature), replay);
}

std::vector<retarget::LevelCost> levels_within(const std::vector<retarget::LevelCost>& levels, const AskedLevel& asked,
                                               const std::string& command) {
  const double budget = budget_ms(asked, command);
  std::vector<retarget::LevelCost> within = levels;
  if (budget > 0) std::erase_if(within, [&](const retarget::LevelCost& cost) { return cost.work_ms > budget; });
  return within;
}

io::LoadedCreature at_level(const io::LoadedCreature& creature, const retarget::Rig& rig, const retarget::LevelCost& cost,
                            const AskedLevel& asked, const std::string& command) {
  io::LoadedCreature level = creature;
  retarget::Performer& performer = level.target.performer;
  const int solved_nodes = performer.mesh.node_count();
  if (cost.wished > 0) {
    retarget::CreatureOptions options = io::level_options(creature);
    options.nodes = cost.wished;
    retarget::Level made = retarget::at_level(performer, creature.signals, rig, options);
    performer = std::move(made.performer);
    level.signals = std::move(made.signals);
  }
  const physics::Body& body = performer.scene.body;
  retarget::BodyReport& report = level.target.report.body;
  report.nodes = body.node_count();
  report.elements = body.elements.empty() ? body.tet_count() : body.elements.front().block.element_count();
  report.constraints = body.edge_count();
  report.mass_kg = body.mass.sum();
  report.pieces = performer.mesh.pieces;
  report.bridged_cells = performer.mesh.bridged_cells;
  report.copied_cells = performer.mesh.copied_cells;
  if (asked.lod != kAuto && cost.wished > 0) {
    const std::string warning = far_from_wish(cost.wished, report.nodes);
    if (!warning.empty()) level.target.report.warnings.push_back(warning);
  }
  level.target.report.level = retarget::LevelReport{report.nodes, solved_nodes, cost.work_ms, budget_ms(asked, command)};
  return level;
}

}  // namespace hydrostat::cli

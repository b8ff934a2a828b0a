#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/bench.h"
#include "cli/command_line.h"
#include "cli/number_option.h"
#include "cli/place_option.h"
#include "cli/subject.h"
#include "io/creature_scene.h"
#include "io/effects_page.h"
#include "io/writable.h"
#include "io/write_file.h"
#include "retarget/effect_bench.h"
#include "retarget/effect_plan.h"
#include "retarget/performed_scenario.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

struct EffectsCommand {
  std::string subject, out;
  double duration = 2;
};

std::vector<retarget::EffectRow> of_scene(const EffectsCommand& command, const io::SceneFile& scene) {
  retarget::SimulationOptions options;
  options.method = scene.method;
  options.dt_s = scene.dt_s;
  options.duration_s = std::min(command.duration, scene.duration_s);
  return std::visit([&](const auto& scenario) { return retarget::measure_effects(scenario, options); }, scene.scenario);
}

/// Its open loop in the scene of its own: feedback would hide what an effect does.
std::vector<retarget::EffectRow> of_creature(const EffectsCommand& command, io::LoadedCreature& creature) {
  retarget::Performer& performer = creature.target.performer;
  io::put_in_own_scene(command.subject, performer);
  retarget::SimulationOptions options;
  options.method = physics::method_named(io::setting(creature.record, "method", "")).value_or(physics::Method::kExplicit);
  options.dt_s = io::setting(creature.record, "step_s", retarget::ReplayOptions().step_s);
  options.duration_s = command.duration;
  retarget::ScenarioOf<3> scenario = retarget::performed_scenario(performer, creature.signals);
  if (scenario.decisions.empty()) retarget::plan_effects<3>({}, scenario);
  return retarget::measure_effects(performer, scenario, options);
}

int effects(const EffectsCommand& command) {
  Subject subject = read_subject(command.subject);
  io::refuse_unwritable(command.out);
  const std::vector<retarget::EffectRow> rows =
      subject.scene ? of_scene(command, *subject.scene) : of_creature(command, *subject.creature);
  const fs::path out = command.out;
  const std::string name = fs::path(command.subject).filename().string();
  io::write_file(out / "effects.csv", io::effects_csv(rows));
  io::write_file(out / "effects.svg", io::effects_svg(name, rows));
  io::write_file(out / "effects.html", io::effects_page(name, rows));
  for (const retarget::EffectRow& row : rows) std::cout << effect_line(row) << "\n";
  return kDone;
}

/// What diverges goes far: its digits before the point would fill lines.
std::string in_digits(double value, int width) {
  char text[40];
  std::snprintf(text, sizeof text, std::abs(value) < 1e6 ? "%*.3f" : "%*.3g", width, value);
  return text;
}

}  // namespace

std::string effect_line(const retarget::EffectRow& row) {
  std::string name = row.effect;
  name.resize(std::max<std::size_t>(13, name.size()), ' ');
  return name + " " + in_digits(row.ms_per_sim_s, 9) + " ms a second, moves it by " + in_digits(100 * row.difference_length, 8) + " % L; all others: " +
         in_digits(row.without_ms_per_sim_s, 9) + " ms, " + in_digits(100 * row.without_difference_length, 8) + " % L from all";
}

void add_bench_effects(CLI::App& bench, int& exit_code) {
  const auto command = std::make_shared<EffectsCommand>();
  CLI::App* sub = bench.add_subcommand("effects", "A scene or creature without effects, with each of its own alone, and with all");
  sub->add_option("SCENE|DIR", command->subject, "TOML file (README, 'Scene files') or creature")->required();
  sub->add_option("-o,--out", command->out, "Directory for effects.csv, effects.svg and effects.html")->check(refuse_no_place)->required();
  sub->add_option("--duration", command->duration, "Seconds to simulate, at most [2]")->check(number_within(0.01, 60));
  sub->callback([command, &exit_code] { exit_code = effects(*command); });
}

}  // namespace hydrostat::cli

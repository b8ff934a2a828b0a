#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/bench.h"
#include "cli/command_line.h"
#include "cli/number_option.h"
#include "cli/subject.h"
#include "io/effects_page.h"
#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

struct EffectsCommand {
  std::string subject, out;
  double duration = 2;
};

int effects(const EffectsCommand& command) {
  const Subject subject = read_subject(command.subject);
  if (!subject.scene) {
    throw Error(command.subject, "", "the effects of a creature cannot be switched one by one",
                "Give a scene, or see 'hydrostat explain'.");
  }
  retarget::SimulationOptions options;
  options.method = subject.scene->method;
  options.dt_s = subject.scene->dt_s;
  options.duration_s = std::min(command.duration, subject.scene->duration_s);
  const std::vector<retarget::EffectRow> rows = std::visit(
      [&](const auto& scenario) { return retarget::measure_effects(scenario, options); }, subject.scene->scenario);
  const fs::path out = command.out;
  const std::string name = fs::path(command.subject).filename().string();
  io::write_file(out / "effects.csv", io::effects_csv(rows));
  io::write_file(out / "effects.svg", io::effects_svg(name, rows));
  io::write_file(out / "effects.html", io::effects_page(name, rows));
  char text[120];
  for (const retarget::EffectRow& row : rows) {
    std::snprintf(text, sizeof text, "%-13s %9.3f ms a second, moves it by %8.3f %% L\n", row.effect.c_str(),
                  row.ms_per_sim_s, 100 * row.difference_length);
    std::cout << text;
  }
  return kDone;
}

}  // namespace

void add_bench_effects(CLI::App& bench, int& exit_code) {
  const auto command = std::make_shared<EffectsCommand>();
  CLI::App* sub = bench.add_subcommand("effects", "A scene without effects, with each of its own alone, and with all");
  sub->add_option("SCENE", command->subject, "TOML file (README, 'Scene files')")->required();
  sub->add_option("-o,--out", command->out, "Directory for effects.csv, effects.svg and effects.html")->required();
  sub->add_option("--duration", command->duration, "Seconds to simulate, at most [2]")->check(number_within(0.01, 60));
  sub->callback([command, &exit_code] { exit_code = effects(*command); });
}

}  // namespace hydrostat::cli

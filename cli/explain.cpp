#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/subcommands.h"
#include "cli/subject.h"
#include "io/creature_scene.h"
#include "retarget/effects.h"
#include "retarget/simulation.h"

namespace hydrostat::cli {

namespace {

struct ExplainCommand {
  std::string subject;
  bool json = false;
};

std::vector<retarget::EffectReport> effects_of(Subject subject, const std::string& path) {
  if (subject.creature) {
    io::put_in_own_scene(path, subject.creature->target.performer);
    retarget::ReplayOptions options;
    options.method =
        physics::method_named(io::setting(subject.creature->record, "method", "")).value_or(physics::Method::kExplicit);
    return retarget::effects_of(subject.creature->target.performer, options);
  }
  const io::SceneFile& scene = *subject.scene;
  retarget::SimulationOptions options;
  options.method = scene.method;
  options.dt_s = scene.dt_s;
  options.duration_s = scene.duration_s;
  return std::visit([&](const auto& scenario) { return retarget::effects_of(scenario, options); }, scene.scenario);
}

int explain(const ExplainCommand& command) {
  const std::vector<retarget::EffectReport> effects = effects_of(read_subject(command.subject), command.subject);
  if (command.json) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const retarget::EffectReport& effect : effects) {
      json.push_back({{"name", effect.name},
                      {"state", effect.state},
                      {"reason", effect.reason},
                      {"ms_per_sim_s", effect.ms_per_sim_s}});
    }
    std::cout << json.dump(1) << "\n";
    return 0;
  }
  char text[80];
  std::cout << "effect        state   ms a second  reason\n";
  for (const retarget::EffectReport& effect : effects) {
    std::snprintf(text, sizeof text, "%-13s %-5s %13.4f  ", effect.name.c_str(), effect.state.c_str(), effect.ms_per_sim_s);
    std::cout << text << effect.reason << "\n";
  }
  return 0;
}

}  // namespace

void add_explain(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<ExplainCommand>();
  CLI::App* sub = app.add_subcommand("explain", "Which effects a scene or creature has, why, and what each costs here");
  sub->add_option("SCENE|DIR", command->subject, "TOML file (README, 'Scene files') or creature")->required();
  sub->add_flag("--json", command->json, "Print it as JSON");
  sub->callback([command, &exit_code] { exit_code = explain(*command); });
}

}  // namespace hydrostat::cli

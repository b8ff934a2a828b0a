#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/bench.h"
#include "cli/command_line.h"
#include "cli/import_options.h"
#include "cli/make_performer.h"
#include "cli/number_option.h"
#include "cli/place_option.h"
#include "cli/progress.h"
#include "io/import_worker.h"
#include "io/write_file.h"
#include "retarget/creature.h"
#include "retarget/performed_scenario.h"
#include "retarget/prepare_standing.h"
#include "retarget/run_warnings.h"
#include "retarget/step_cost.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

constexpr const char* kSpeedCommand = "hydrostat bench speed";
constexpr int kReadings = 5;  // of a clip
constexpr const char* kSmallClip =
    "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\nJOINT b\n{\nOFFSET 0 1 0\n"
    "CHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\n"
    "MOTION\nFrames: 2\nFrame Time: 0.5\n0 0 0 0 0 0\n0 0 0 0 0 9\n";

struct SpeedCommand {
  std::string clip_file, clip, out, nodes = "150,300,500";
  double duration = 4;
  bool json = false, quiet = false;
  io::ImportOptions import;
};

/// What one body costs; processor time of all threads.
struct SpeedRow {
  int nodes = 0, constraints = 0, frames = 0;
  double body_ms = 0, coupling_ms = 0, preparation_ms = 0, inverse_ms = 0, signals_ms = 0;
  double simulation_ms = 0, counted_ms = 0, correction_ms = 0, counted_correction_ms = 0;  // for a simulated second

  double real_time() const { return 1000 / (simulation_ms + correction_ms); }
};

/// One way to tell a row: as columns of a table and as fields.
struct Column {
  const char *name, *title;
  double (*value)(const SpeedRow& row);
};
constexpr Column kColumns[] = {
    {"nodes", "nodes", [](const SpeedRow& row) { return double(row.nodes); }},
    {"constraints", "constraints", [](const SpeedRow& row) { return double(row.constraints); }},
    {"frames", "frames", [](const SpeedRow& row) { return double(row.frames); }},
    {"body_ms", "body [ms]", [](const SpeedRow& row) { return row.body_ms; }},
    {"coupling_ms_per_frame", "coupling [ms a frame]", [](const SpeedRow& row) { return row.coupling_ms / row.frames; }},
    {"preparation_ms_per_frame", "preparation [ms a frame]",
     [](const SpeedRow& row) { return row.preparation_ms / row.frames; }},
    {"inverse_ms_per_frame", "inverse dynamics [ms a frame]",
     [](const SpeedRow& row) { return row.inverse_ms / row.frames; }},
    {"signals_ms", "signals [ms]", [](const SpeedRow& row) { return row.signals_ms; }},
    {"simulation_ms_per_s", "simulation [ms a second]", [](const SpeedRow& row) { return row.simulation_ms; }},
    {"counted_ms_per_s", "the same, counted", [](const SpeedRow& row) { return row.counted_ms; }},
    {"correction_ms_per_s", "correction [ms a second]", [](const SpeedRow& row) { return row.correction_ms; }},
    {"counted_correction_ms_per_s", "the same, counted", [](const SpeedRow& row) { return row.counted_correction_ms; }},
    {"real_time", "times real time", [](const SpeedRow& row) { return row.real_time(); }}};

double process_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Processor time [ms] of `work`, whose result goes to `result`.
template <typename Result, typename Work>
double ms_of(Result& result, const Work& work) {
  const double began = process_ms();
  result = work();
  return process_ms() - began;
}

std::vector<int> wished_nodes(const std::string& list) {
  std::vector<int> nodes;
  for (const std::string& part : CLI::detail::split(list, ','))
    nodes.push_back(static_cast<int>(parse_number(part, 20, 5000, kSpeedCommand, "--nodes")));
  return nodes;
}

/// Processor time [ms] that the reading process takes for a file, the best of several.
double reading_ms(const std::string& file, const io::ReadLimits& limits) {
  double least = 0;
  for (int i = 0; i < kReadings; ++i) {
    io::ReadCost cost;
    io::read_in_worker(file, limits, &cost);
    if (i == 0 || cost.cpu_s < least) least = cost.cpu_s;
  }
  return 1e3 * least;
}

/// Simulation alone, and with the corrector, for a simulated second each.
void measure_replay(const retarget::Performer& performer, const retarget::SignalSet& signals, physics::Method method,
                    double duration_s, SpeedRow& row) {
  retarget::SimulationOptions steps;
  steps.method = method;
  steps.dt_s = retarget::ReplayOptions().step_s;
  steps.duration_s = duration_s;
  steps.figures = false;
  const retarget::ScenarioOf<3> scenario = retarget::performed_scenario(performer, signals);
  retarget::Simulation simulation;
  const double simulation_ms = ms_of(simulation, [&] { return retarget::simulate(scenario, steps); });
  const double simulated_s = std::max(1, static_cast<int>(simulation.motion.count()) - 1) / simulation.motion.rate_hz;
  row.simulation_ms = simulation_ms / simulated_s;
  row.counted_ms = retarget::counted_ms(scenario.scene, method, true, simulated_s / steps.dt_s, simulation.work) / simulated_s;
  retarget::PerformOptions perform;
  perform.replay.method = method;
  perform.replay.duration_s = duration_s;
  perform.baselines = false;
  perform.threads = 1;
  retarget::Performances performances;
  const double replay_ms = ms_of(performances, [&] { return retarget::perform(performer, signals, perform); });
  const retarget::Replay& run = performances.main();
  const double replayed_s = std::max(1, static_cast<int>(run.motion.count()) - 1) / run.motion.rate_hz;
  row.correction_ms = std::max(0.0, replay_ms / replayed_s - row.simulation_ms);
  row.counted_correction_ms = retarget::counted_ms_of_correction(performer.scene, performer.muscles.fields.cols()) /
                              (perform.replay.step_s * perform.replay.steps_per_control);
}

SpeedRow measure(const SpeedCommand& command, const retarget::Character& character, int wished) {
  retarget::CreatureOptions settings;
  settings.nodes = wished;
  settings.threads = 1;
  SpeedRow row;
  retarget::Creature creature;
  row.body_ms = ms_of(creature, [&] { return retarget::make_creature(character, settings); });
  row.nodes = creature.mesh.node_count();
  row.constraints = creature.scene.body.edge_count();
  retarget::ImportedMotion motion;
  row.coupling_ms = ms_of(motion, [&] { return retarget::import_motion(creature, settings); });
  row.frames = static_cast<int>(motion.nodes.count());
  retarget::PreparedTarget prepared;
  row.preparation_ms = ms_of(prepared, [&] { return prepared_target(creature, motion, settings); });
  retarget::fit_body(prepared, creature.scene.body);
  retarget::InverseOptions inverse_options;
  inverse_options.threads = 1;
  retarget::InverseDynamics inverse;
  row.inverse_ms = ms_of(inverse, [&] {
    return retarget::solve_within_automatic_limit(prepared, creature.scene, creature.length, inverse_options);
  });
  const retarget::Performer performer = make_performer(creature, motion, std::move(prepared));
  retarget::SignalSet signals;
  row.signals_ms = ms_of(signals, [&] { return solved_signals(inverse, performer, command.clip_file, command.clip); });
  measure_replay(performer, signals, settings.method, command.duration, row);
  return row;
}

std::string csv(const std::vector<SpeedRow>& rows) {
  std::string text;
  for (const Column& column : kColumns) text += std::string(text.empty() ? "" : ",") + column.name;
  char number[40];
  for (const SpeedRow& row : rows) {
    std::string line;
    for (const Column& column : kColumns) {
      std::snprintf(number, sizeof number, "%.6g", column.value(row));
      line += (line.empty() ? "" : ",") + std::string(number);
    }
    text += "\n" + line;
  }
  return text + "\n";
}

/// As README shows it: a line for each part, a column for each body.
std::string table(const std::vector<SpeedRow>& rows) {
  std::string text;
  char number[40];
  for (const Column& column : kColumns) {
    text += std::string("| ") + column.title + " |";
    for (const SpeedRow& row : rows) {
      std::snprintf(number, sizeof number, column.value(row) < 1e5 ? " %.3g |" : " %.0f |", column.value(row));
      text += number;
    }
    text += "\n";
    if (&column != &kColumns[0]) continue;
    text += "| --- |";
    for (std::size_t k = 0; k < rows.size(); ++k) text += " --- |";
    text += "\n";
  }
  return text;
}

int speed(const SpeedCommand& command) {
  const std::vector<int> wished = wished_nodes(command.nodes);
  Progress progress(std::cerr, progress_style(command.quiet));
  const fs::path out = command.out, small = out / "small.bvh";
  progress.begin("import");
  io::write_file(small, kSmallClip);
  const double small_ms = reading_ms(small.string(), command.import.limits);
  fs::remove(small);
  const double read_ms = reading_ms(command.clip_file, command.import.limits);
  io::ImportOptions import = command.import;
  import.sample_rate_hz = retarget::CreatureOptions().rate_hz;
  retarget::Character character;
  const double import_ms =
      ms_of(character, [&] { return io::import_character(command.clip_file, command.clip, import); });
  std::vector<SpeedRow> rows;
  for (const int nodes : wished) {
    progress.begin(std::to_string(nodes) + " nodes");
    rows.push_back(measure(command, character, nodes));
  }
  progress.end();
  io::write_file(out / "speed.csv", csv(rows));
  if (command.json) {
    nlohmann::ordered_json json{{"schema", "hydrostat.speed/1"},
                                {"file", command.clip_file},
                                {"clip", character.clip.name},
                                {"small_read_ms", small_ms},
                                {"read_ms", read_ms},
                                {"import_ms", import_ms},
                                {"rows", nlohmann::ordered_json::array()}};
    for (const SpeedRow& row : rows) {
      nlohmann::ordered_json told;
      for (const Column& column : kColumns) told[column.name] = column.value(row);
      json["rows"].push_back(std::move(told));
    }
    std::cout << json.dump(2) << "\n";
    return kDone;
  }
  std::printf("reading a small file %.1f ms, this clip %.1f ms (the reading process); its import %.1f ms\n\n%s", small_ms, read_ms,
              import_ms, table(rows).c_str());
  return kDone;
}

}  // namespace

void add_bench_speed(CLI::App& bench, int& exit_code) {
  const auto command = std::make_shared<SpeedCommand>();
  CLI::App* sub = bench.add_subcommand("speed", "What each stage of a conversion costs, at several numbers of nodes");
  sub->add_option("CLIP", command->clip_file, "FBX, glTF, ... as for 'hydrostat convert'")->required();
  sub->add_option("-o,--out", command->out, "Directory for speed.csv")->check(refuse_no_place)->required();
  sub->add_option("--clip", command->clip, "Clip by name or index [the first that lasts]");
  sub->add_option("--nodes", command->nodes, "Wished numbers of control nodes")->capture_default_str();
  sub->add_option("--duration", command->duration, "Seconds to simulate, at most")
      ->check(number_within(0.1, 60))
      ->capture_default_str();
  add_import_options(*sub, command->import);
  sub->add_flag("--json", command->json, "Print what was found as JSON");
  sub->add_flag("--quiet", command->quiet, "No progress");
  sub->callback([command, &exit_code] { exit_code = speed(*command); });
}

}  // namespace hydrostat::cli

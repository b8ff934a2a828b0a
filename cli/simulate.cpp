#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <future>
#include <iostream>
#include <memory>
#include <thread>

#include "cli/asked_accuracy.h"
#include "cli/command_line.h"
#include "cli/number_option.h"
#include "cli/outcome.h"
#include "cli/place_option.h"
#include "cli/stages.h"
#include "io/creature_directory.h"
#include "io/creature_record.h"
#include "io/report.h"
#include "io/simulation_files.h"
#include "io/trace_writer.h"
#include "retarget/accuracy.h"
#include "retarget/run_warnings.h"
#include "retarget/step_warning.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

constexpr const char* kSimulateCommand = "hydrostat simulate";
constexpr double kLongestRun = 3600;   // [s]
constexpr double kFirstMeasured = 2;   // [s] of the motion, on which most settings are tried where --max-error is asked for
constexpr double kLargestTrace = 4e9;  // [bytes]

struct SimulateCommand {
  std::string scene, out, method, trace;
  AskedAccuracy accuracy;
  double duration = 0, trace_rate = 0;
  unsigned seed = 0;
  bool seed_is_given = false, json = false, quiet = false;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
};

/// How many steps a row of the trace spans.
int steps_per_row(const SimulateCommand& command, double dt_s) {
  if (command.trace_rate == 0) return 1;
  const double every = 1 / (dt_s * command.trace_rate);
  if (every < 1 - 1e-9 || std::abs(every - std::round(every)) > 1e-6 * every) {
    char text[120];
    std::snprintf(text, sizeof text, "%g Hz is not a whole part of the %g Hz at which the scene is stepped",
                  command.trace_rate, 1 / dt_s);
    throw UsageError(kSimulateCommand, "option --trace-rate", text, "Give a whole part of it.");
  }
  return static_cast<int>(std::lround(every));
}

retarget::SimulationOptions options_of(const SimulateCommand& command, const io::SceneFile& scene) {
  retarget::SimulationOptions options;
  options.method = scene.method;
  options.dt_s = scene.dt_s;
  options.duration_s = scene.duration_s;
  options.trace = !command.trace.empty();
  options.steps_per_row = steps_per_row(command, scene.dt_s);
  return options;
}

/// What command line and scene file say together.
io::SceneFile read_scene(const SimulateCommand& command) {
  const auto given = [](bool is_given, auto value) { return is_given ? std::optional(value) : std::nullopt; };
  io::SceneFile scene = io::read_scene_file(command.scene, given(command.seed_is_given, command.seed), std::nullopt, "",
                                            given(command.duration > 0, command.duration));
  if (!command.method.empty()) {
    const std::optional<physics::Method> method = io::method_named(command.method);
    if (method) scene.method = *method;
    scene.method_is_auto = !method;
  }
  return scene;
}

void refuse_large_trace(const SimulateCommand& command, const retarget::SimulationOptions& options, Eigen::Index nodes,
                        Eigen::Index edges) {
  if (!options.trace) return;
  const double rows = options.duration_s / (options.dt_s * options.steps_per_row);
  if (rows * 8 * static_cast<double>(15 * nodes + edges) <= kLargestTrace) return;
  throw UsageError(kSimulateCommand, "option --trace", "the trace would take more than 4 GB of memory",
                   command.trace_rate > 0 ? "Give a smaller --trace-rate or --duration." : "Give a --trace-rate.");
}

/// Takes the cheapest method and step that keep the error asked for, and tells of them.
ChosenStep choose(const SimulateCommand& command, io::SceneFile& scene) {
  retarget::AccuracyOptions options;
  options.duration_s = std::min(kFirstMeasured, scene.duration_s);
  return std::visit(
      [&]<int Dim>(const retarget::ScenarioOf<Dim>& scenario) {
        ChosenStep chosen = choose_step(command.accuracy, kSimulateCommand, retarget::make_reference(scenario, options),
                                        scene.method_is_auto ? std::nullopt : std::optional(scene.method), scene.duration_s);
        scene.method = chosen.setting.method;
        scene.dt_s = chosen.setting.dt_s;
        return chosen;
      },
      scene.scenario);
}

/// What of the way it is stepped should be known.
void warn_of_steps(io::SceneFile& scene) {
  if (scene.method != physics::Method::kExplicit) return;
  const std::string warning = std::visit(
      [&](const auto& scenario) { return retarget::explicit_step_warning(scenario.scene, scene.dt_s, scene.damping_time_s); }, scene.scenario);
  if (!warning.empty()) scene.warnings.push_back(warning);
}

/// `written`: with the body as the files have it.
template <int Dim>
void fill_report(const io::SceneFile& scene, const retarget::ScenarioOf<Dim>& scenario, const retarget::ScenarioOf<Dim>& written,
                 const retarget::SimulationOptions& options, retarget::RunReport& report) {
  const physics::BodyOf<Dim>& body = written.scene.body;
  report.source.file = scene.file;
  report.source.sha256 = scene.sha256;
  report.source.duration_s = options.duration_s;
  report.source.rate_hz = 1 / options.dt_s;
  report.source.root_motion = "none";
  report.body.nodes = body.node_count();
  report.body.elements = body.tet_count();
  if (!body.elements.empty()) report.body.elements = body.elements.front().block.element_count();
  report.body.constraints = body.edge_count();
  report.body.vertices = written.scene.contact_points.count();
  report.body.mass_kg = body.mass.sum();
  report.body.length_m = scenario.length;
  report.body.size_m = scenario.size;
  report.body.youngs_modulus_pa = scenario.youngs_modulus;
  report.body.pieces = 1;
  report.effects = retarget::effects_of(scenario, options);
  report.accuracy.method = physics::name_of(options.method);
  report.accuracy.element = scene.element;
  report.accuracy.material = scene.law;
  report.accuracy.dt_s = physics::make_stepper(options.method, scenario.scene)->substep(options.dt_s);
}

io::CreatureRecord record_of(const io::SceneFile& scene, const retarget::RunReport& report) {
  io::CreatureRecord record;
  record.source_file = scene.file;
  record.source_sha256 = scene.sha256;
  record.settings = {{"kind", std::string("scene")},
                     {"method", physics::name_of(scene.method)},
                     {"element", scene.element},
                     {"law", scene.law},
                     {"dt_s", scene.dt_s},
                     {"duration_s", scene.duration_s},
                     {"seed", static_cast<std::int64_t>(scene.seed)}};
  for (const retarget::EffectReport& effect : report.effects)
    record.effects.push_back({effect.name, effect.state, effect.reason});
  return record;
}

void write_files(io::CreatureWriter& writer, const io::SceneFile& scene, const retarget::Simulation& simulation,
                 const retarget::RunReport& report, const std::optional<ChosenStep>& chosen) {
  writer.write("creature.toml", io::to_toml(record_of(scene, report)));
  writer.write("body.json", io::scene_body_text(scene));
  writer.write("report.json", io::report_json(report));
  io::write_simulation_glb(writer.directory() / (report.outcome_ok ? "replay.glb" : "failed.glb"), scene, simulation);
  io::write_simulation_page(writer.directory() / "report.html", scene, simulation, report,
                            chosen ? io::accuracy_svg(chosen->curve) : "");
  if (chosen) write_curve(writer, chosen->curve);
}

std::string summary(const retarget::RunReport& report, const std::string& where) {
  const retarget::SimulationReport& run = *report.simulation;
  char text[300], torn[80] = "", assist[60] = "";
  if (!run.fractures.empty()) {
    std::snprintf(torn, sizeof torn, "; broke at %.3f s, %d piece%s", run.fractures.front().time_s, run.pieces_end, run.pieces_end == 1 ? "" : "s");
  }
  if (retarget::is_assisted(run)) std::snprintf(assist, sizeof assist, "; assisted from outside by up to %.2g mg", run.external_assist_mg);
  std::snprintf(text, sizeof text,
                ": %.3g s of %d nodes by '%s'; travel %.3f L, volume error %.2f %% at most, penetration %.2f %% D, %d "
                "inverted elements; "
                "%.1fx real time",
                run.duration_s, report.body.nodes, report.accuracy.method.c_str(), run.travel_length,
                100 * run.volume_error_max, 100 * run.penetration_max_size, run.inverted_elements, run.real_time_factor);
  return where + text + torn + assist;
}

int tell(const SimulateCommand& command, const retarget::RunReport& report) {
  const retarget::SimulationReport& run = *report.simulation;
  if (command.json) std::cout << io::report_json(report);
  if (run.diverged) {
    std::cerr << one_line({command.scene, "simulation", "it diverged: " + run.diverged_cause,
                           (fs::path(command.out) / "failed.glb").string() +
                               " shows it; try --method euler, a smaller dt_s or a softer body"})
              << std::endl;
    return kShortOfTarget;
  }
  if (!report.accuracy.is_met()) {
    std::cerr << too_inaccurate(command.scene, report.accuracy) << std::endl;
    return kShortOfTarget;
  }
  if (command.json) return kDone;
  std::cout << summary(report, command.out) << "\n" << saved_words(report);
  for (const std::string& warning : report.warnings) {
    if (warning.starts_with("accuracy: ")) std::cout << warning << ".\n";
  }
  return kDone;
}

int simulate(const SimulateCommand& command) {
  Progress progress(std::cerr, progress_style(command.quiet));
  Stages stages(progress);
  io::SceneFile scene = stages.run("scene", [&] { return read_scene(command); });
  if (!command.trace.empty()) {
    io::refuse_trace(command.trace);
    const auto whole = [](const std::string& path) {
      return (std::filesystem::weakly_canonical(std::filesystem::absolute(path)) / "").lexically_normal();
    };
    if (whole(command.trace) == whole(command.out)) {
      throw UsageError(kSimulateCommand, "option --trace", "'" + command.trace + "' is where the outcome goes", "Name another folder, which may lie in it.");
    }
  }
  io::CreatureWriter writer(command.out, io::CreatureWriter::Start::afresh, io::CreatureWriter::Kind::simulation);
  retarget::RunReport report;
  std::optional<ChosenStep> chosen;
  if (command.accuracy.is_asked()) {
    chosen = stages.run("accuracy", [&] { return choose(command, scene); });
    report.accuracy = chosen->report;
    scene.warnings.insert(scene.warnings.end(), chosen->warnings.begin(), chosen->warnings.end());
  }
  const retarget::SimulationOptions options = options_of(command, scene);
  warn_of_steps(scene);
  const retarget::Simulation simulation = std::visit(
      [&](auto& scenario) {
        auto written = retarget::written_scenario(scenario);
        refuse_large_trace(command, options, written.scene.body.node_count(), written.scene.body.edge_count());
        // A second thread measures the error meanwhile; without one it is done when it is asked for.
        std::future<retarget::EstimatedError> error = std::async(
            command.threads > 1 ? std::launch::async : std::launch::deferred, [alone = scenario, &options, &command] {
              return command.accuracy.is_asked() ? retarget::EstimatedError() : retarget::estimated_error(alone, options);
            });
        scenario.scene.threads = std::max(1, command.threads - 1);
        retarget::Simulation run = stages.run("simulation", [&] { return retarget::simulate(scenario, options); });
        stages.run("measurement", [&] {
          fill_report(scene, scenario, written, options, report);
          if (!command.accuracy.is_asked()) {
            const retarget::EstimatedError estimate = error.get();
            report.accuracy.estimated_error_length = estimate.error_length;
            report.accuracy.estimated_span_s = estimate.span_s;
            const retarget::StepSetting setting{options.method, options.dt_s};
            if (!retarget::break_alike(estimate.breaking, estimate.finer_breaking, retarget::AccuracyOptions().frame_s)) {
              scene.warnings.push_back(breaks_otherwise(setting, estimate.breaking, estimate.finer, estimate.finer_breaking));
            }
          }
          return 0;
        });
        scenario = std::move(written);
        return run;
      },
      scene.scenario);
  report.simulation = simulation.report;
  report.outcome_ok = !simulation.report.diverged && report.accuracy.is_met();
  report.warnings = scene.warnings;
  for (const std::string& warning : retarget::motion_warnings(simulation.report)) report.warnings.push_back(warning);
  report.timing_s = stages.timing_s;
  try {
    write_files(writer, scene, simulation, report, chosen);
  } catch (const Error& error) {
    throw writer.as_seen(error);
  }
  writer.commit();
  note_warnings(progress, report.warnings, "accuracy: ");
  if (!command.trace.empty()) io::write_trace(command.trace, simulation.trace);  // which may lie in the outcome
  return tell(command, report);
}

}  // namespace

void add_simulate(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<SimulateCommand>();
  CLI::App* sub = app.add_subcommand("simulate", "Simulate a scene without a clip: shapes, materials, obstacles, signals");
  sub->add_option("SCENE", command->scene, "TOML file (README, 'Scene files')")->required();
  sub->add_option("-o,--out", command->out, "Directory for motion, report and page; replaced as a whole")->check(refuse_no_place)->required();
  sub->add_option("--method", command->method, "Time integration [the scene's]")->check(CLI::IsMember(io::method_names()));
  sub->add_option("--duration", command->duration, "Seconds to simulate [the scene's]")
      ->check(number_within(1e-3, kLongestRun));
  add_accuracy_options(*sub, command->accuracy);
  CLI::Option* seed = sub->add_option("--seed", command->seed, "Of a random start [the scene's]");
  CLI::Option* trace =
      sub->add_option("--trace", command->trace, "Directory for masses, positions, velocities, forces as NumPy files")->check(refuse_no_place);
  sub->add_option("--trace-rate", command->trace_rate,
                  "Rows a second, a whole part of the scene's steps a second [all steps]")
      ->check(number_within(0.01, 1e6))
      ->needs(trace);
  sub->add_option("--threads", command->threads, "At most so many; the outcome does not hang on it")
      ->check(number_within(1, 256));
  sub->add_flag("--json", command->json, "Print the report as JSON");
  sub->add_flag("--quiet", command->quiet, "No progress");
  sub->callback([command, seed, &exit_code] {
    command->seed_is_given = seed->count() > 0;
    exit_code = simulate(*command);
  });
}

}  // namespace hydrostat::cli

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/asked_accuracy.h"
#include "cli/bench.h"
#include "cli/command_line.h"
#include "cli/number_option.h"
#include "cli/place_option.h"
#include "cli/progress.h"
#include "cli/subject.h"
#include "io/accuracy_page.h"
#include "io/scene_file.h"
#include "io/writable.h"
#include "io/write_file.h"
#include "retarget/error.h"
#include "retarget/performed_scenario.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

constexpr const char* kAccuracyCommand = "hydrostat bench accuracy";
constexpr double kParts[] = {0.25, 0.5, 1, 2};  // of the scene's number of nodes
constexpr double kFinest = 4;                   // the reference's
constexpr double kFinerMesh = 1.7;    // what is left of a mesh's error over its change from half the nodes, of second order
constexpr double kUsualError = 0.01;  // per L
constexpr double kLevels[] = {0.25, 0.5, 1, 2, 4};     // of a creature's nodes
constexpr double kOtherLevels[] = {0.5, 1};            // where it is made of other elements than its own
constexpr int kFewestNodes = 20;                       // of a level
constexpr double kBriefMs = 40;                        // of the processor: a row that takes less is timed
constexpr int kTimings = 4;                            // so many times
constexpr double kBriefly = 4;                         // [s] for which a level has to stay up
constexpr double kHarmonics[] = {1, 0.75, 0.5, 0.25};  // of a creature's

struct AccuracyCommand {
  std::string subject, out, max_error;
  double duration = 1;
  bool own_mesh = false, json = false, quiet = false;
};

template <int Dim>
std::string in_words(const retarget::ReferenceOf<Dim>& reference) {
  char text[400];
  std::snprintf(text, sizeof text,
                "Errors are distances to '%s' in steps of %.3g ms (%d nodes), which moves by %.2g %% of L when its steps "
                "are doubled and "
                "is %.2g %% from '%s' in steps of %.3g ms; %s.",
                physics::name_of(reference.setting.method).c_str(), 1000 * reference.setting.dt_s,
                reference.scenario.scene.body.node_count(), 100 * reference.own_error_m / reference.scenario.length,
                100 * reference.check_distance_m / reference.scenario.length,
                physics::name_of(reference.check.method).c_str(), 1000 * reference.check.dt_s,
                reference.windows.size() > 1
                    ? "they are taken in short windows that start from it, for in contact paths part in any method"
                    : "nothing touches, so the whole motion is compared");
  return text;
}

template <int Dim>
const retarget::ScenarioOf<Dim>& scenario_of(const io::SceneFile& scene) {
  return std::get<retarget::ScenarioOf<Dim>>(scene.scenario);
}

/// The scene in another mesh; none where its shape or law has no such elements.
std::optional<io::SceneFile> remeshed(const fs::path& file, int nodes, const std::string& element) {
  try {
    return io::read_scene_file(file, std::nullopt, nodes, element);
  } catch (const Error&) {
    return std::nullopt;
  }
}

void refuse_below_floor(const std::string& max_error, double most, double floor) {
  if (max_error.empty() || most > floor) return;
  char text[160];
  std::snprintf(text, sizeof text, "the reference itself is only known within %.2g %% of L, so that %.2g %% cannot be told",
                100 * floor, 100 * most);
  throw UsageError(kAccuracyCommand, "option --max-error", text, "Ask for a larger error.");
}

class Bench {
 public:
  Bench(const AccuracyCommand& command, Progress& progress) : command_(command), progress_(progress) {
    curve_.subject = fs::path(command.subject).filename().string();
    curve_.max_error = kUsualError;
    if (!command.max_error.empty()) curve_.max_error = parse_share(command.max_error, kAccuracyCommand, "--max-error");
    options_.duration_s = command.duration;
  }

  io::AccuracyCurve run() {
    const Subject subject = read_subject(command_.subject);
    io::refuse_unwritable(command_.out);
    if (subject.creature) {
      of_creature(*subject.creature);
    } else {
      const io::SceneFile& scene = *subject.scene;
      std::visit([&]<int Dim>(const retarget::ScenarioOf<Dim>&) { of_scene<Dim>(scene); }, scene.scenario);
    }
    refuse_below_floor(command_.max_error, curve_.max_error, curve_.floor);
    if (command_.max_error.empty() && curve_.max_error <= curve_.floor) ask_for_least();
    curve_.recommended = retarget::cheapest_within(curve_.rows, curve_.max_error * length_, &retarget::AccuracyRow::ms_per_sim_s);
    return std::move(curve_);
  }

 private:
  /// What takes short is timed again: other work on the machine only adds to a time.
  template <class Measure>
  retarget::AccuracyRow timed(const Measure& measure) const {
    retarget::AccuracyRow row = measure();
    for (int k = 1; k < kTimings && row.ms_per_sim_s * options_.duration_s < kBriefMs; ++k) {
      row.ms_per_sim_s = std::min(row.ms_per_sim_s, measure().ms_per_sim_s);
    }
    return row;
  }

  /// The usual error cannot be told: the cheapest within the least that can is marked, and the page says so.
  void ask_for_least() {
    char text[160];
    std::snprintf(text, sizeof text, " The usual %.3g %% cannot be told by it: marked is the least time within the least error that can.",
                  100 * curve_.max_error);
    curve_.truth += text;
    curve_.max_error = curve_.floor;
  }

  template <int Dim>
  void of_scene(const io::SceneFile& scene) {
    scene_file_ = scene.file;
    options_.duration_s = std::min(options_.duration_s, scene.duration_s);
    const int own = scenario_of<Dim>(scene).scene.body.node_count();
    std::vector<io::SceneFile> meshes{scene};
    io::SceneFile finest = scene;
    double mesh_error_m = 0;
    if (!command_.own_mesh) {
      meshes.clear();
      // Boxes come last, for they do not lock: where there are any, theirs is nearest to the body that all meshes stand for.
      for (const char* element : {"triangle", "tet", "quad", "hex"}) {
        for (const double part : kParts) add_mesh<Dim>(meshes, static_cast<int>(std::lround(part * own)), element);
      }
      if (meshes.empty()) meshes.push_back(scene);
      finest =
          remeshed(scene_file_, static_cast<int>(std::lround(kFinest * own)), meshes.back().element).value_or(meshes.back());
    }
    progress_.begin("reference");
    const retarget::ReferenceOf<Dim> reference = retarget::make_reference<Dim>(scenario_of<Dim>(finest), options_);
    if (!command_.own_mesh) {
      const std::optional<io::SceneFile> half =
          remeshed(scene_file_, static_cast<int>(std::lround(0.5 * kFinest * own)), finest.element);
      if (half) {
        mesh_error_m =
            kFinerMesh * retarget::measure_error<Dim>(reference, scenario_of<Dim>(*half), reference.setting).error_rms_m;
      }
    }
    tell(reference);
    curve_.floor = (reference.uncertainty_m() + mesh_error_m) / length_;
    if (mesh_error_m > 0) {
      char text[160];
      std::snprintf(text, sizeof text, " Its mesh leaves some %.2g %% of L open, by its distance to one of half the nodes.",
                    100 * mesh_error_m / length_);
      curve_.truth += text;
    }
    for (const io::SceneFile& mesh : meshes) {
      const retarget::ScenarioOf<Dim>& scenario = scenario_of<Dim>(mesh);
      progress_.begin(std::to_string(scenario.scene.body.node_count()) + " nodes, " + mesh.element);
      for (const auto& of_method : retarget::settings_to_try(scenario.scene, options_.step_frame_s)) {
        for (const retarget::StepSetting& setting : of_method) {
          curve_.rows.push_back(timed([&] { return retarget::measure_error(reference, scenario, setting); }));
        }
      }
    }
  }

  /// Where shape and law have such elements and it is no mesh that is there already.
  template <int Dim>
  void add_mesh(std::vector<io::SceneFile>& meshes, int wished, const std::string& element) const {
    std::optional<io::SceneFile> mesh = remeshed(scene_file_, wished, element);
    if (!mesh) return;
    const int nodes = scenario_of<Dim>(*mesh).scene.body.node_count();
    for (const io::SceneFile& other : meshes) {
      if (other.element == element && scenario_of<Dim>(other).scene.body.node_count() == nodes) return;
    }
    meshes.push_back(std::move(*mesh));
  }

  void of_creature(const io::LoadedCreature& creature) {
    progress_.begin("reference");
    const retarget::Performer& performer = creature.target.performer;
    options_.step_frame_s = kControlSeconds;
    const retarget::ReferenceOf<3> reference = retarget::performed_reference(performer, creature.signals, options_);
    tell(reference);
    const int all = creature.signals.activation.harmonics();
    for (const double part : kHarmonics) {
      const int harmonics = static_cast<int>(std::lround(part * all));
      if (harmonics < 1) break;
      progress_.begin(std::to_string(harmonics) + " harmonics");
      const retarget::ScenarioOf<3> scenario = retarget::performed_scenario(performer, creature.signals, harmonics);
      for (const auto& of_method : retarget::settings_to_try(scenario.scene, options_.step_frame_s)) {
        for (const retarget::StepSetting& setting : of_method) {
          curve_.rows.push_back(timed([&] { return retarget::measure_error(reference, scenario, setting); }));
          curve_.rows.back().harmonics = harmonics;
        }
      }
    }
    const bool has_rig = fs::exists(fs::path(command_.subject) / "rig.bin");  // an older one has none
    if (!command_.own_mesh && has_rig) of_levels(creature, reference);
  }

  /// The creature by its own method and step on coarser and finer meshes, on its own, and on some of other elements.
  void of_levels(const io::LoadedCreature& creature, const retarget::ReferenceOf<3>& reference) {
    const retarget::Rig rig = io::load_rig(command_.subject, creature);
    const retarget::Performer& solved = creature.target.performer;
    const retarget::CreatureOptions own = io::level_options(creature);
    for (const double part : kLevels) {
      if (part == 1) {
        add_level(creature, {solved, creature.signals}, reference);
        continue;
      }
      const std::optional<retarget::Level> level = level_of(creature, rig, own, part);
      // None that has the creature's own lattice.
      if (level && level->performer.mesh.node_count() != solved.mesh.node_count()) add_level(creature, *level, reference);
    }
    constexpr std::pair<bool, retarget::BodyMaterial> kKinds[] = {{false, retarget::BodyMaterial::kSprings},
                                                                  {false, retarget::BodyMaterial::kStableNeoHookean},
                                                                  {true, retarget::BodyMaterial::kStableNeoHookean}};
    for (const auto& [hexahedra, material] : kKinds) {
      const bool is_springs = material == retarget::BodyMaterial::kSprings;
      if (hexahedra == own.hexahedra && is_springs == (own.material == retarget::BodyMaterial::kSprings)) continue;
      retarget::CreatureOptions other = own;
      other.hexahedra = hexahedra;
      other.material = material;
      other.calibrated = own.calibrated && !hexahedra && !is_springs;
      for (const double part : kOtherLevels) {
        if (const std::optional<retarget::Level> level = level_of(creature, rig, other, part)) add_level(creature, *level, reference);
      }
    }
  }

  /// None where it would have too few nodes.
  std::optional<retarget::Level> level_of(const io::LoadedCreature& creature, const retarget::Rig& rig, retarget::CreatureOptions options,
                                          double part) {
    const retarget::Performer& solved = creature.target.performer;
    options.nodes = static_cast<int>(std::lround(part * solved.mesh.node_count()));
    if (options.nodes < kFewestNodes) return std::nullopt;
    progress_.begin("level of " + std::to_string(options.nodes) + " nodes, " + (options.hexahedra ? "hex, " : "tet, ") +
                    retarget::name_of(options.material));
    return retarget::at_level(solved, creature.signals, rig, options);
  }

  /// One whose closed loop falls is told so.
  void add_level(const io::LoadedCreature& creature, const retarget::Level& level, const retarget::ReferenceOf<3>& reference) {
    retarget::PerformOptions brief;
    retarget::ReplayOptions& replay = brief.replay;
    replay.method = physics::method_named(io::setting(creature.record, "method", "")).value_or(physics::Method::kExplicit);
    take_steps(replay, {replay.method, io::setting(creature.record, "step_s", replay.step_s)});
    const retarget::StepSetting setting{replay.method, replay.step_s};
    retarget::AccuracyRow row = timed([&] { return retarget::measure_level(reference, level.performer, level.signals, setting); });
    row.harmonics = level.signals.activation.harmonics();
    brief.baselines = false;
    brief.feedback = io::feedback_of(creature.record);
    replay.duration_s = std::min(kBriefly, retarget::usual_duration(level.performer.prepared.target));
    const retarget::Performances runs = retarget::perform_steadily(level.performer, level.signals, brief);
    row.falls = runs.main().report.fell || runs.main().termination != physics::Termination::kDone;
    row.stable = row.stable && !row.falls;
    curve_.rows.push_back(row);
  }

  template <int Dim>
  void tell(const retarget::ReferenceOf<Dim>& reference) {
    length_ = reference.scenario.length;
    curve_.floor = reference.uncertainty_m() / length_;
    curve_.truth = in_words(reference);
    refuse_below_floor(command_.max_error, curve_.max_error, curve_.floor);
  }

  const AccuracyCommand& command_;
  Progress& progress_;
  retarget::AccuracyOptions options_;
  io::AccuracyCurve curve_;
  double length_ = 1;
  fs::path scene_file_;
};

std::string summary(const io::AccuracyCurve& curve) {
  const std::vector<bool> front = retarget::pareto_front(curve.rows);
  std::string all;
  char text[240];
  for (std::size_t k = 0; k < curve.rows.size(); ++k) {
    const retarget::AccuracyRow& row = curve.rows[k];
    if (!front[k] && static_cast<int>(k) != curve.recommended) continue;
    const std::string harmonics = row.harmonics > 0 ? " " + std::to_string(row.harmonics) + " harmonics" : "";
    std::snprintf(text, sizeof text, "%s %-8s %5d nodes %-8s step %9.6f s%s: error %8.4f %% L, %8.2f ms a second\n",
                  static_cast<int>(k) == curve.recommended ? "->" : "  ", row.method.c_str(), row.nodes, row.element.c_str(),
                  row.dt_s, harmonics.c_str(), 100 * row.error_rel_length, row.ms_per_sim_s);
    all += text;
  }
  return all;
}

int accuracy(const AccuracyCommand& command) {
  Progress progress(std::cerr, progress_style(command.quiet));
  const io::AccuracyCurve curve = Bench(command, progress).run();
  progress.end();
  const fs::path out = command.out;
  io::write_file(out / "accuracy.csv", io::accuracy_csv(curve));
  io::write_file(out / "accuracy.svg", io::accuracy_svg(curve));
  io::write_file(out / "accuracy.html", io::accuracy_page(curve));
  std::cout << (command.json ? io::accuracy_json(curve) : summary(curve));
  if (curve.recommended >= 0) return kDone;
  const int best = retarget::most_accurate(curve.rows);
  char text[200];
  if (best < 0) {
    std::snprintf(text, sizeof text, "no setting that was tried stays finite");
  } else {
    const retarget::AccuracyRow& row = curve.rows[static_cast<std::size_t>(best)];
    std::snprintf(text, sizeof text,
                  "no setting that was tried stays within %.3g %% of L; the nearest, '%s' with steps of %.3g s, has %.3g %%",
                  100 * curve.max_error, row.method.c_str(), row.dt_s, 100 * row.error_rel_length);
  }
  std::cerr << one_line({command.subject, "bench", text, "Ask for a larger --max-error or give the scene more nodes"})
            << std::endl;
  return kShortOfTarget;
}

}  // namespace

void add_bench_accuracy(CLI::App& bench, int& exit_code) {
  const auto command = std::make_shared<AccuracyCommand>();
  CLI::App* sub =
      bench.add_subcommand("accuracy", "Error against time: methods, steps, elements, nodes (harmonics of a creature)");
  sub->add_option("SCENE|DIR", command->subject, "TOML file (README, 'Scene files') or creature")->required();
  sub->add_option("-o,--out", command->out, "Directory for accuracy.csv, accuracy.svg and accuracy.html")->check(refuse_no_place)->required();
  sub->add_option("--max-error", command->max_error, "The error, 1% or 0.01 of L, within which the cheapest is marked [1%, or the least that can be told]")
      ->check(refuse_empty);
  sub->add_option("--duration", command->duration, "Seconds of the motion that are compared, at most [1]")
      ->check(number_within(0.1, 60));
  sub->add_flag("--own-mesh", command->own_mesh, "Only the scene's or creature's own mesh: errors are those of methods and steps alone");
  sub->add_flag("--json", command->json, "Print what was found as JSON");
  sub->add_flag("--quiet", command->quiet, "No progress");
  sub->callback([command, &exit_code] { exit_code = accuracy(*command); });
}

}  // namespace hydrostat::cli

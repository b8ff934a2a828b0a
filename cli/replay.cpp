#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <thread>

#include "cli/asked_accuracy.h"
#include "cli/command_line.h"
#include "cli/export_option.h"
#include "cli/level_option.h"
#include "cli/level_trial.h"
#include "cli/number_option.h"
#include "cli/outcome.h"
#include "cli/place_option.h"
#include "cli/stages.h"
#include "cli/wobble_option.h"
#include "io/creature_scene.h"
#include "io/gltf_out.h"
#include "io/load_creature.h"
#include "io/trace_writer.h"
#include "io/writable.h"
#include "retarget/error.h"
#include "retarget/run_warnings.h"
#include "retarget/wobble_plan.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

constexpr const char* kReplayCommand = "hydrostat replay";
constexpr double kLongest = 600;       // [s] of a replay
constexpr double kFastestPush = 100;   // [m/s] along an axis

struct ReplayCommand {
  std::string directory, out, scene, trace, wobble;
  AskedAccuracy accuracy;
  AskedLevel level;
  AskedExport exports;
  double duration = 0, cycles = 0, trace_rate = 0;
  bool open_loop = false, json = false, quiet = false;
  std::vector<std::string> pushes;
  unsigned seed = 0;
  bool seed_is_given = false;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
};

UsageError push_error(const std::string& text, const std::string& what) {
  return {kReplayCommand, "option --push", "'" + text + "' " + what, "Write it like t=2,dv=0.3:0:0 (seconds, metres per second)."};
}

/// "t=2,dv=0.3:0:0".
retarget::Push parse_push(const std::string& text, double duration_s) {
  retarget::Push push;
  bool has_time = false, has_speed = false;
  for (const std::string& part : CLI::detail::split(text, ',')) {
    if (part.starts_with("t=")) {
      push.time_s = parse_number(part.substr(2), 0, kLongest, kReplayCommand, "--push t");
      has_time = true;
    } else if (part.starts_with("dv=")) {
      const std::vector<std::string> axes = CLI::detail::split(part.substr(3), ':');
      if (axes.size() != 3) throw push_error(text, "has not three speeds in dv");
      for (std::size_t k = 0; k < 3; ++k) {
        push.delta_v[static_cast<Eigen::Index>(k)] = parse_number(axes[k], -kFastestPush, kFastestPush, kReplayCommand, "--push dv");
      }
      has_speed = true;
    } else {
      throw push_error(text, "has a part '" + part + "' that is neither t nor dv");
    }
  }
  if (!has_time || !has_speed) throw push_error(text, has_time ? "lacks dv" : "lacks t");
  if (push.time_s >= duration_s) throw push_error(text, "comes after the end of the replay");
  return push;
}

/// How many control steps a row of the trace spans.
int steps_per_row(const ReplayCommand& command, const retarget::ReplayOptions& options) {
  if (command.trace_rate == 0) return 1;
  const double control_hz = 1 / (options.step_s * options.steps_per_control);
  const double every = control_hz / command.trace_rate;
  if (every < 1 - 1e-9 || std::abs(every - std::round(every)) > 1e-6) {
    char text[120];
    std::snprintf(text, sizeof text, "%g Hz is not a whole part of the %g Hz at which the replay is controlled", command.trace_rate, control_hz);
    throw UsageError(kReplayCommand, "option --trace-rate", text, "Give 120, 60, 40, 30, ...");
  }
  return static_cast<int>(std::lround(every));
}

retarget::PerformOptions perform_options(const ReplayCommand& command, const io::LoadedCreature& creature) {
  const retarget::Motion& target = creature.target.performer.prepared.target;
  retarget::PerformOptions options;
  options.replay.method = physics::method_named(io::setting(creature.record, "method", "")).value_or(physics::Method::kExplicit);
  take_steps(options.replay, {options.replay.method, io::setting(creature.record, "step_s", options.replay.step_s)});
  options.feedback = io::feedback_of(creature.record);
  options.replay.duration_s = command.duration > 0  ? command.duration
                              : command.cycles > 0 ? command.cycles * target.duration_s()
                                                   : retarget::usual_duration(target);
  if (options.replay.duration_s > kLongest) {
    throw UsageError(kReplayCommand, "option --cycles", "so many cycles last longer than 600 s", "Give fewer.");
  }
  for (const std::string& push : command.pushes) options.replay.pushes.push_back(parse_push(push, options.replay.duration_s));
  options.replay.trace = !command.trace.empty();
  options.seed = command.seed_is_given ? command.seed : static_cast<unsigned>(io::setting(creature.record, "seed", 0.0));
  options.closed_loop = !command.open_loop;
  options.baselines = command.out.empty();
  options.threads = command.threads;
  return options;
}

void write_trace(const ReplayCommand& command, const retarget::World& world, const retarget::Trace& trace, int every) {
  io::write_trace(command.trace, retarget::in_world(world, retarget::thinned(trace, every)));
}

/// Into the scene that was asked for, else into its own.
void put_in_scene(const ReplayCommand& command, io::LoadedCreature& creature) {
  retarget::Performer& performer = creature.target.performer;
  if (command.scene.empty()) {
    io::put_in_own_scene(command.directory, performer);
    return;
  }
  std::vector<std::string>& warnings = creature.target.report.warnings;
  for (const std::string& warning : io::put_in_scene(command.scene, performer)) warnings.push_back(warning);
}

/// Refuses a scene that cannot be before anything else is done.
void check_scene(const ReplayCommand& command, io::LoadedCreature creature) { put_in_scene(command, creature); }

/// Pushes are told as the scene has its axes.
retarget::PerformOptions in_its_world(retarget::PerformOptions options, const retarget::Performer& performer) {
  for (retarget::Push& push : options.replay.pushes) push.delta_v = performer.world.turn.transpose() * push.delta_v;
  return options;
}

/// Those of the creature unless given; of a file of its own the rate alone.
io::Exports exports_of(const ReplayCommand& command, const io::CreatureRecord& record) {
  io::Exports otherwise = io::exports_of(record);
  if (!command.out.empty()) otherwise = {.rate_hz = otherwise.rate_hz};
  return exports_of(command.exports, otherwise, kReplayCommand);
}

/// The motion alone, for -o.
int write_motion(const ReplayCommand& command, const retarget::Performer& performer, const io::Appearance& appearance,
                 const retarget::Performances& performances, const io::Exports& exports, const std::string& way_up) {
  const retarget::Replay& run = performances.main();
  const fs::path file = is_down(run) ? fs::path(command.out).parent_path() / "failed.glb" : fs::path(command.out);
  const retarget::MovingMorphs worn = retarget::worn_with(performer.morphs, retarget::wobble_morphs(performer, run.motion));
  const io::EmbeddedSkin skin{performer.skin.vertices, performer.skin.triangles, performer.embedding, &appearance, &worn};
  const retarget::Motion motion = retarget::in_world(performer.world, run.motion, 0);
  io::write_skinned_glb(file, skin, performer.mesh, performer.scene.body.mass, motion, {});
  if (!is_down(run)) io::write_exports(file, skin, performer.mesh, performer.scene.body.mass, motion, exports);
  return tell_run(run, command.directory, file.string(), way_up);
}

constexpr double kEnoughWay = 0.8;  // of the clip's travel

/// What of the clip's way a replay makes: 0 where it is down or stays where it is, 1 where the clip does not travel either.
double way_kept(const retarget::Replay& run) {
  constexpr double kLeastTravel = 0.01;  // of L a cycle
  if (is_down(run)) return 0;
  const double wanted = run.report.clip_travel_per_cycle_length;
  return wanted < kLeastTravel ? 1 : std::max(0.0, run.report.travel_per_cycle_length / wanted);
}

/// The levels that were asked for, one after the other in the creature's place; none where none were.
class Levels {
 public:
  Levels(const ReplayCommand& command, io::LoadedCreature& creature, const retarget::PerformOptions& options, Stages& stages)
      : command_(command), stages_(stages), options_(options) {
    if (!command.level.is_asked()) return;
    solved_ = creature;
    rig_ = io::load_rig(command.directory, creature);
    all_ = stages.run("levels", [&] { return levels_asked_among(command.level, kReplayCommand, creature, rig_, options.replay); });
    levels_ = levels_within(all_, command.level, kReplayCommand);
    is_costed_ = all_.front().work_ms > 0;
    if (levels_.empty()) throw no_level_within(kReplayCommand, budget_ms(command.level, kReplayCommand), all_, trial_above(0));
    take(creature);
  }
  /// What to do where the creature is down on the level that was taken; empty where that is not known.
  std::string way_up(const io::LoadedCreature& creature) {
    if (levels_.empty()) return "";
    try {
      if (!is_costed_) all_ = retarget::level_costs(solved_.target.performer, rig_, io::level_options(solved_), options_.replay);
    } catch (const Error&) {  // a level that was not asked for
      return "";
    }
    const double taken_ms = creature.target.report.level->work_ms, budget = budget_ms(command_.level, kReplayCommand);
    return cli::way_up(trial_above(std::max(taken_ms, budget)), budget > 0);
  }
  /// Where the present one kept too little of the clip's way: the next coarser one, after the last the best of them, with a word on
  /// each that was left. False where there is none.
  bool take_better(double way, io::LoadedCreature& creature) {
    if (way >= kEnoughWay || levels_.empty() || ways_.size() == levels_.size()) return false;
    ways_.push_back(way);
    std::size_t next = ways_.size();
    if (next == levels_.size()) next = static_cast<std::size_t>(std::max_element(ways_.begin(), ways_.end()) - ways_.begin());
    if (next == taken_ || (next < ways_.size() && ways_[next] == 0)) return false;
    taken_ = next;
    take(creature);
    for (std::size_t k = 0; k < ways_.size(); ++k) {
      if (k != taken_) creature.target.report.warnings.push_back(left(levels_[k].nodes, ways_[k]));
    }
    return true;
  }

 private:
  static std::string left(int nodes, double way) {
    char text[120];
    std::snprintf(text, sizeof text, "level: on %d nodes, which the budget allows, the creature ", nodes);
    std::string word = "fell or got nowhere";
    if (way > 0) word = "kept " + std::to_string(std::lround(100 * way)) + " % of the clip's way";
    return text + word;
  }
  void take(io::LoadedCreature& creature) {
    creature = stages_.run("level", [&] { return at_level(solved_, rig_, levels_[taken_], command_.level, kReplayCommand); });
    if (is_costed_) return;
    const retarget::Performer& performer = creature.target.performer;
    creature.target.report.level->work_ms = retarget::frame_work_ms(performer.scene, performer.muscles.fields.cols(), options_.replay);
  }
  LevelTrial trial_above(double work_ms) {
    const auto keeps_way = [this](const retarget::LevelCost& level) {
      try {
        return way_kept(replay_of(level)) >= kEnoughWay;
      } catch (const Error&) {  // no body or no plan on so few nodes
        return false;
      }
    };
    const int own_nodes = solved_.target.performer.mesh.node_count();
    return stages_.run("other levels", [&] { return try_levels(all_, work_ms, own_nodes, options_.replay.duration_s, keeps_way); });
  }
  retarget::Replay replay_of(const retarget::LevelCost& level) const {
    io::LoadedCreature creature = at_level(solved_, rig_, level, command_.level, kReplayCommand);
    put_in_scene(command_, creature);
    retarget::PerformOptions options = in_its_world(options_, creature.target.performer);
    options.baselines = options.replay.trace = false;
    return retarget::perform_steadily(creature.target.performer, creature.signals, options).main();
  }

  const ReplayCommand& command_;
  Stages& stages_;
  io::LoadedCreature solved_;
  retarget::Rig rig_;
  retarget::PerformOptions options_;
  std::vector<retarget::LevelCost> all_, levels_;  // those to be tried among all
  bool is_costed_ = false;
  std::size_t taken_ = 0;
  std::vector<double> ways_;  // of the levels tried, see way_kept
};

/// What a person is told of the level, before the replay's own line.
void tell_level(const retarget::RunReport& report, const std::string& where) {
  const std::optional<retarget::LevelReport>& level = report.level;
  if (!level) return;
  char text[160];
  std::snprintf(text, sizeof text, ": on %d nodes (solved on %d), %.3g ms of counted work a frame of 1/60 s\n", level->nodes,
                level->solved_nodes, level->work_ms);
  std::cout << where << text;
  for (const std::string& warning : report.warnings) {
    if (warning.starts_with("level: ")) std::cout << warning << ".\n";
  }
}

/// A level may stay up and yet not get on.
void warn_of_lost_way(const retarget::Replay& run, std::vector<std::string>& warnings) {
  const double way = way_kept(run);
  if (is_down(run) || way >= kEnoughWay) return;
  char text[120];
  std::snprintf(text, sizeof text, "level: the creature stays up, but makes %.0f %% of the clip's way: another level may keep it better", 100 * way);
  warnings.emplace_back(text);
}

/// A push may fell any creature.
std::string usual_way_up(const ReplayCommand& command, const retarget::Replay& run) {
  if (command.open_loop) return "leave --open-loop out";
  return command.pushes.empty() ? "convert again with " + change_of_conversion(run) : "";
}

std::vector<std::string> beyond(const std::vector<std::string>& known, const std::vector<std::string>& warnings) {
  std::vector<std::string> fresh;
  for (const std::string& warning : warnings) {
    if (std::find(known.begin(), known.end(), warning) == known.end()) fresh.push_back(warning);
  }
  return fresh;
}

/// Where no report does.
void tell_accuracy(const ChosenStep& chosen, const retarget::Performer& performer) {
  retarget::RunReport run;
  run.accuracy = told(chosen);
  run.body.nodes = performer.mesh.node_count();
  std::cout << saved_words(run);
}

/// What is the creature's own goes with its report.
void refuse_own_motion(const ReplayCommand& command) {
  for (const char* name : {"replay.glb", "failed.glb", "reference.glb"}) {
    std::error_code ignored;  // what cannot be resolved is refused where it is read or written
    if (fs::weakly_canonical(command.out, ignored) != fs::weakly_canonical(fs::path(command.directory) / name, ignored)) continue;
    throw UsageError(kReplayCommand, "option --out", "'" + command.out + "' is the creature's own " + name + ", which its report tells of",
                     "Leave --out out to have replay.glb and the report anew, or name another file.");
  }
}

/// Refuses places in which nothing can be written, before anything is simulated.
void refuse_places(const ReplayCommand& command, const io::Exports& exports) {
  if (!command.out.empty()) io::refuse_unwritable_file(command.out);
  if (!command.out.empty()) io::refuse_exports(command.out, exports);
  if (!command.trace.empty()) io::refuse_trace(command.trace);
}

/// A creature let go again as a command asks for; its stages, in the order of run().
class CreatureReplay {
 public:
  CreatureReplay(const ReplayCommand& command, int every)
      : command_(command), every_(every), progress_(std::cerr, progress_style(command.quiet)), stages_(progress_) {}

  int run() {
    creature_ = stages_.run("load", [&] { return io::load_creature(command_.directory); });
    const std::vector<std::string> of_conversion = warnings();  // which told them
    options_ = perform_options(command_, creature_);
    const WobbleChoice wobble(command_.wobble, command_.level.is_asked(), command_.directory, creature_);
    check_scene(command_, creature_);
    exports_ = exports_of(command_, creature_.record);
    refuse_places(command_, exports_);
    Levels levels(command_, creature_, options_, stages_);
    wobble.plan(performer());
    if (command_.accuracy.is_asked()) choose_steps();
    put_in_scene(command_, creature_);  // levels and accuracy are of the flat ground
    options_ = in_its_world(options_, performer());
    std::optional<io::CreatureWriter> writer;
    if (command_.out.empty()) writer.emplace(command_.directory, io::CreatureWriter::Start::amended);

    perform();
    while (levels.take_better(way_kept(main()), creature_)) {
      wobble.plan(performer());
      put_in_scene(command_, creature_);
      perform();
    }
    take_finer_steps();
    if (is_down(main())) way_up_ = levels.way_up(creature_);
    if (is_down(main()) && way_up_.empty()) way_up_ = usual_way_up(command_, main());
    add_warnings();
    options_.feedback = performances_.feedback;
    if (!command_.json) tell_level(creature_.target.report, command_.directory);
    note_warnings(progress_, beyond(of_conversion, warnings()), "level: ");
    return writer ? renew(*writer) : write_alone();
  }

 private:
  retarget::Performer& performer() { return creature_.target.performer; }
  const retarget::Replay& main() const { return performances_.main(); }
  std::vector<std::string>& warnings() { return creature_.target.report.warnings; }

  /// The cheapest that keep the error asked for.
  void choose_steps() {
    chosen_ = stages_.run("accuracy", [&] { return choose_step(command_.accuracy, kReplayCommand, performer(), creature_.signals, std::nullopt); });
    take_steps(options_.replay, chosen_->setting);
  }

  void perform() {
    performances_ = stages_.run("replay", [&] {
      if (!command_.level.is_asked()) return retarget::perform(performer(), creature_.signals, options_);
      return retarget::perform_steadily(performer(), creature_.signals, options_);
    });
  }

  /// Where the creature falls by those that keep the error.
  void take_finer_steps() {
    while (chosen_ && !command_.open_loop && is_down(main()) && take_next(*chosen_, performer(), creature_.signals)) {
      warnings().push_back(chosen_->warnings.back());
      take_steps(options_.replay, chosen_->setting);
      perform();
    }
  }

  void add_warnings() {
    for (const std::string& warning : retarget::feedback_warnings(performances_, options_.feedback)) warnings().push_back(warning);
    for (const std::string& warning : retarget::motion_warnings(main().report)) warnings().push_back(warning);
    if (command_.level.is_asked()) warn_of_lost_way(main(), warnings());
  }

  void keep_trace() {
    if (!command_.trace.empty()) write_trace(command_, performer().world, main().trace, every_);
  }

  /// The motion alone, for -o.
  int write_alone() {
    keep_trace();
    const int exit_code = write_motion(command_, performer(), creature_.appearance, performances_, exports_, way_up_);
    if (!chosen_) return exit_code;
    tell_accuracy(*chosen_, performer());
    return met(told(*chosen_), exit_code);
  }

  /// The creature's own motion and report.
  int renew(io::CreatureWriter& writer) {
    retarget::RunReport& report = creature_.target.report;
    renew_report(report);
    try {
      if (exports_ != io::exports_of(creature_.record)) {
        io::put_exports(exports_, creature_.record);
        writer.write("creature.toml", io::to_toml(creature_.record));
      }
      write_outcome(writer, performer(), creature_.appearance, creature_.signals, performances_, report,
                    chosen_ ? &chosen_->curve : nullptr, exports_);
    } catch (const Error& error) {
      throw writer.as_seen(error);
    }
    writer.commit();
    keep_trace();  // which may lie in the creature
    const std::string motion_file = (fs::path(command_.directory) / "failed.glb").string();
    const int exit_code = command_.json ? tell_report(main(), command_.directory, motion_file, report, way_up_)
                                        : tell_run(main(), command_.directory, motion_file, way_up_);
    if (!command_.json) std::cout << saved_words(report);
    return met(report.accuracy, exit_code);
  }

  void renew_report(retarget::RunReport& report) {
    const double signal_error = report.signals.error_rms_l0;
    report.signals = signals_report(creature_.signals);
    report.signals.error_rms_l0 = signal_error;
    stages_.run("measurement", [&] {
      report.accuracy = chosen_ ? told(*chosen_) : retarget::AccuracyReport();
      measure(performer(), creature_.signals, options_, report);
      return 0;
    });
    report_replays(performances_, report);
    report.timing_s = stages_.timing_s;
  }

  /// The exit code in the end: a replay that went well may be short of the accuracy that was asked for, which it tells.
  int met(const retarget::AccuracyReport& accuracy, int exit_code) const {
    if (accuracy.is_met() || exit_code != kDone) return exit_code;
    std::cerr << too_inaccurate(command_.directory, accuracy) << std::endl;
    return kShortOfTarget;
  }

  const ReplayCommand& command_;
  const int every_;  // control steps a row of the trace
  Progress progress_;
  Stages stages_;
  io::LoadedCreature creature_;
  retarget::PerformOptions options_;
  io::Exports exports_;
  std::optional<ChosenStep> chosen_;
  retarget::Performances performances_;
  std::string way_up_;  // what to do where it is down
};

int replay(const ReplayCommand& command) {
  if (!command.out.empty() && fs::path(command.out).extension() != ".glb") {
    throw UsageError(kReplayCommand, "option --out", "'" + command.out + "' does not end with .glb", "The motion is written as binary glTF.");
  }
  if (!command.out.empty()) refuse_own_motion(command);
  return CreatureReplay(command, steps_per_row(command, {})).run();
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<ReplayCommand>();
  CLI::App* replay_command = app.add_subcommand("replay", "Simulate a creature again, with its signals as they now are");
  replay_command->add_option("DIR", command->directory, "Creature, as convert wrote it")->required();
  CLI::Option* out = replay_command->add_option("-o,--out", command->out, "Write the motion alone, to this .glb file")->check(refuse_no_place);
  CLI::Option* duration = replay_command->add_option("--duration", command->duration, "Seconds to simulate [15 cycles, 10 s at most]")
                              ->check(number_within(0.1, kLongest));
  replay_command->add_option("--cycles", command->cycles, "The same in periods of the clip")
      ->check(number_within(0.1, 10000))
      ->excludes(duration);
  replay_command->add_option("--scene", command->scene, "World to let it go in, a TOML file (README, 'A creature's scene') [the creature's]")
      ->check(refuse_no_place);
  replay_command->add_flag("--open-loop", command->open_loop, "Leave the corrector out");
  replay_command->add_option("--push", command->pushes, "t=2,dv=0.3:0:0: a force on the whole body for 0.1 s from t [s] on that would "
                                                        "change its velocity by dv [m/s]; may be given several times")
      ->allow_extra_args(false);
  add_accuracy_options(*replay_command, command->accuracy);
  add_level_options(*replay_command, command->level);
  for (const char* other : {"--max-error", "--accuracy"}) {
    replay_command->get_option("--lod")->excludes(replay_command->get_option(other));
  }
  add_wobble_option(*replay_command, command->wobble, "See 'hydrostat convert --help' [the creature's]");
  add_export_options(*replay_command, command->exports, " [the creature's]");
  CLI::Option* seed = replay_command->add_option("--seed", command->seed, "See 'hydrostat convert --help' [the creature's]");
  CLI::Option* trace = replay_command->add_option("--trace", command->trace, "Directory for masses, positions, velocities, forces as NumPy files")
                             ->check(refuse_no_place);
  replay_command->add_option("--trace-rate", command->trace_rate, "Rows a second, a whole part of the 120 of the control")
      ->check(number_within(0.1, 1e6))
      ->needs(trace);
  replay_command->add_option("--threads", command->threads, "At most so many; the outcome does not hang on it")
      ->check(number_within(1, 256));
  replay_command->add_flag("--json", command->json, "Print the report as JSON")->excludes(out);
  replay_command->add_flag("--quiet", command->quiet, "No progress");
  replay_command->callback([command, seed, &exit_code] {
    command->seed_is_given = seed->count() > 0;
    exit_code = replay(*command);
  });
}

}  // namespace hydrostat::cli

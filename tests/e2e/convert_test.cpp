#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "tests/e2e/made_creature.h"
#include "tests/e2e/trace_audit.h"

namespace hydrostat::convert_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// What a sample must reach with the default settings.
struct Gate {
  const char* clip;
  const char* kind;                     // of its signals
  bool stays_up;
  double cycles;                        // at least
  double shape, clip_shape;             // [per L] at most, against the target and the imported clip
  double least_travel, most_travel;     // over the clip's own
  double drift;                         // [per L a cycle] at most
  double apex;                          // of a jump: at most so far from the clip's rise, as a share of it; 0: not in the air
  bool walks_on_legs;                   // all that touches the ground
  bool has_levels;                      // goes on a quarter of its nodes, too
};
constexpr Gate kGates[] = {
    {"worm_crawl.glb", "loop", true, 4.99, 0.005, 0.04, 0.92, 1.08, 0.003, 0, false, false},
    {"boxdog_trot.fbx", "loop", true, 14.99, 0.01, 0.04, 0.92, 1.08, 0.003, 0, true, true},
    {"boxdog_jump.glb", "one_shot", true, 1, 0.03, 0.04, 0.92, 1.08, 0.03, 0.12, true, false},
};
constexpr double kHeading = 0.3;  // [deg] a cycle
// Of the inverse dynamics, on every sample.
constexpr double kMiss = 3e-4, kRootResidual = 0.01, kSaturated = 0.05;

// Of a trace at the rate of the control.
constexpr double kMomentum = 1e-6;       // [mg]
constexpr double kAngularMomentum = 1e-3;  // [mgL]: the moment of gravity is taken at the row's middle
constexpr double kContactMoment = 0.03;    // [mgL]: of the forces at the row's middle, between which the nodes shake
constexpr double kPathMiss = 0.3;          // of the way: landing and standing shake within a row
constexpr double kNearGround = 0.002;    // [per L]

// Of a jump.
constexpr double kFallMiss = 0.02;     // [g] of the COM's acceleration while nothing touches
constexpr double kLeastFlight = 0.5;   // of the clip's time in the air
constexpr double kClearGround = 0.01;  // [per L] under the lowest foot

const std::map<std::string, std::set<std::string>> kReportGroups{
    {"source", {"file", "sha256", "clip", "duration_s", "rate_hz", "scale", "root_motion"}},
    {"body", {"nodes", "elements", "constraints", "vertices", "mass_kg", "length_m", "size_m", "youngs_modulus_pa"}},
    {"coupling", {"error_rms_length"}},
    {"preparation",
     {"smooth_shift_rms_length", "foot_shift_rms_length", "volume_shift_rms_length", "momentum_shift_rms_length",
      "missing_wrench_rms_mg", "missing_wrench_max_mg", "flight_s"}},
    {"inverse", {"miss_rms_length", "root_residual_mg", "kkt_residual", "saturated", "max_strain", "p95_strain", "limit"}},
    {"signals", {"kind", "period_s", "count", "harmonics", "error_rms_l0"}},
    {"accuracy", {"method", "element", "material", "dt_s", "estimated_error_length"}},
    {"timing_s", {"total"}}};
const std::set<std::string> kReplayKeys{
    "cycles",           "duration_s",       "fell",           "fall_time_s",
    "fall_cause",       "shape_rms_length", "world_rms_length", "drift_per_cycle_length",
    "clip_shape_rms_length", "heading_deg_per_cycle", "travel_per_cycle_length", "clip_travel_per_cycle_length",
    "slip_per_stance_length", "held_slip_per_stance_length", "sole_gap_length", "penetration_max_size", "volume_error_max",
    "momentum_residual_mg", "angular_residual_mgl", "external_assist_mg", "inverted_elements",
    "guard_steps",      "correction_rms",   "feedback_rms", "real_time_factor"};

void expect_contract(const fs::path& creature, bool stays_up) {
  std::set<std::string> files{"creature.toml", "appearance.bin", "body.json",   "target.bin", "signals.json",
                              "reference.glb", "report.json",    "report.html", "cache",      "rig.bin"};
  files.insert(stays_up ? "replay.glb" : "failed.glb");
  if (effect_of(creature, "wobble").at("state") == "on") files.insert("wobble.bin");
  EXPECT_EQ(names_in(creature), files);
  const json report = report_of(creature);
  EXPECT_EQ(report.at("schema"), "hydrostat.report/1");
  for (const auto& [group, keys] : kReportGroups) {
    ASSERT_TRUE(report.contains(group)) << group;
    for (const std::string& key : keys) {
      EXPECT_TRUE(report[group].contains(key) && !report[group][key].is_null()) << group << "." << key;
    }
  }
  for (const char* run : {"naive", "open_loop", "closed_loop"}) {
    SCOPED_TRACE(run);
    const json& figures = report.at("replay").at(run);
    for (const std::string& key : kReplayKeys) EXPECT_TRUE(figures.contains(key)) << key;
    EXPECT_EQ(figures.at("external_assist_mg"), 0);
    EXPECT_EQ(figures.at("guard_steps"), 0);
    EXPECT_LE(figures.at("momentum_residual_mg"), kMomentum);
    EXPECT_LE(figures.at("angular_residual_mgl"), kMomentum);
    EXPECT_EQ(figures.at("inverted_elements"), 0);
  }
  ASSERT_GE(report.at("effects").size(), 10U);
  for (const json& effect : report["effects"]) {
    SCOPED_TRACE(effect.dump());
    EXPECT_TRUE(effect.at("state") == "on" || effect.at("state") == "off");
    EXPECT_NE(effect.at("reason"), "");
    EXPECT_TRUE(effect.at("state") == "on" || effect.at("ms_per_sim_s") == 0);
  }
  EXPECT_TRUE(report.at("warnings").is_array());
  EXPECT_EQ(json::parse(io::read_file(creature / "body.json")).at("schema"), "hydrostat.body/1");
  EXPECT_NE(io::read_file(creature / "creature.toml").find(report["source"]["sha256"].get<std::string>()), std::string::npos);
}

void expect_gate(const fs::path& creature, const Gate& gate) {
  const json report = report_of(creature);
  EXPECT_EQ(report["signals"]["kind"], gate.kind);
  EXPECT_LE(report["signals"]["error_rms_l0"], 0.003);
  EXPECT_LE(report["inverse"]["miss_rms_length"], kMiss);
  EXPECT_LE(report["inverse"]["root_residual_mg"], kRootResidual);
  EXPECT_LE(report["inverse"]["saturated"], kSaturated);
  EXPECT_GT(report["preparation"]["min_jacobian"], 0);
  EXPECT_EQ(report["body"]["pieces"], 1);
  const json& run = report["replay"]["closed_loop"];
  EXPECT_EQ(run["fell"], !gate.stays_up) << run["fall_cause"];
  EXPECT_GE(run["cycles"], gate.cycles);
  EXPECT_LE(run["shape_rms_length"], gate.shape);
  EXPECT_LE(run["clip_shape_rms_length"], gate.clip_shape);
  const double travel = run["travel_per_cycle_length"].get<double>() / run["clip_travel_per_cycle_length"].get<double>();
  EXPECT_GE(travel, gate.least_travel);
  EXPECT_LE(travel, gate.most_travel);
  EXPECT_LE(std::abs(run["drift_per_cycle_length"].get<double>()), gate.drift);
  EXPECT_LE(std::abs(run["heading_deg_per_cycle"].get<double>()), kHeading);
  const json body = json::parse(io::read_file(creature / "body.json"));
  ASSERT_FALSE(body.at("patches").empty());
  for (const json& patch : body["patches"]) EXPECT_EQ(patch.at("on_leg"), gate.walks_on_legs) << patch["name"];
}

/// Leaves the ground with all feet for most of the time that the clip is in the air, flies as a stone does, and as high as the clip.
void expect_jump(const fs::path& creature, const fs::path& trace, double apex) {
  const json report = report_of(creature);
  const json& run = report["replay"]["closed_loop"];
  const double rise = run["apex_rise_length"], clip_rise = run["clip_apex_rise_length"];
  EXPECT_GT(clip_rise, 0);
  EXPECT_NEAR(rise, clip_rise, apex * clip_rise);
  const FlightAudit flight = audit_flight(trace, creature);
  EXPECT_GE(flight.longest_s, kLeastFlight * report["preparation"]["flight_s"].get<double>());
  EXPECT_GT(flight.longest_s, 0);
  EXPECT_GE(flight.height_m, kClearGround * report["body"]["length_m"].get<double>());
  EXPECT_LE(flight.fall_miss, kFallMiss);
}

void expect_honest_trace(const fs::path& directory, const std::string& creature) {
  hydrostat_in(directory, "replay " + in_quotes(creature) + " --quiet --duration 2 -o motion.glb --trace trace");
  const TraceAudit audit = audit_trace(directory / "trace", directory / creature);
  const double length = report_of(directory / creature)["body"]["length_m"];
  EXPECT_NEAR(audit.slowest_row_s, 1.0 / 120, 1e-9);
  EXPECT_NEAR(audit.fastest_row_s, 1.0 / 120, 1e-9);
  EXPECT_LE(audit.path_miss, kPathMiss);
  EXPECT_LE(audit.com_path_miss, 1);
  EXPECT_LE(audit.momentum_mg, kMomentum);
  EXPECT_LE(audit.angular_mgl, kAngularMomentum);
  EXPECT_LE(audit.moment_mgl, kContactMoment);
  EXPECT_LE(audit.cone_excess_mg, 1e-9);
  EXPECT_LE(audit.pull_mg, 1e-12);
  EXPECT_LE(audit.loaded_height_m, kNearGround * length);
  EXPECT_EQ(audit.effect_mg, 0);
  EXPECT_EQ(audit.correction_ns, 0);
}

/// On a quarter of its nodes.
void expect_coarse_level(const fs::path& directory) {
  EXPECT_EQ(hydrostat_in(directory, "replay creature --quiet --lod 52 --cycles 8 --json").exit_code, 0);
  const json report = report_of(directory / "creature"), run = report["replay"]["closed_loop"];
  EXPECT_LE(report["level"]["nodes"].get<double>(), 0.26 * report["level"]["solved_nodes"].get<double>());
  EXPECT_FALSE(run["fell"]);
  EXPECT_LE(run["shape_rms_length"], 0.01);
  EXPECT_NEAR(run["travel_per_cycle_length"].get<double>() / run["clip_travel_per_cycle_length"].get<double>(), 1, 0.05);
}

void expect_sample(const Gate& gate) {
  SCOPED_TRACE(gate.clip);
  const TemporaryDirectory directory;
  const Outcome outcome = convert(directory.path, gate.clip, "creature");
  EXPECT_EQ(outcome.exit_code, gate.stays_up ? 0 : 3) << outcome.err;
  ASSERT_TRUE(fs::exists(directory.path / "creature"));
  expect_contract(directory.path / "creature", gate.stays_up);
  expect_gate(directory.path / "creature", gate);
  expect_honest_trace(directory.path, "creature");
  if (gate.apex > 0) expect_jump(directory.path / "creature", directory.path / "trace", gate.apex);
  if (gate.has_levels) expect_coarse_level(directory.path);
}

TEST(Convert, LetsTheWormCrawlByItself) { expect_sample(kGates[0]); }
TEST(Convert, LetsTheDogTrotByItself) { expect_sample(kGates[1]); }
TEST(Convert, LetsTheDogJumpByItself) { expect_sample(kGates[2]); }

TEST(Convert, GivesTheSameBytesForAnyNumberOfThreads) {
  const TemporaryDirectory directory;
  convert(directory.path, kSmallClip, "one", std::string(kSmallOptions) + "--threads 1");
  convert(directory.path, kSmallClip, "two", std::string(kSmallOptions) + "--threads 2");
  const fs::path one = directory.path / "one", two = directory.path / "two";
  ASSERT_EQ(names_in(one), names_in(two));
  for (const char* name : {"signals.json", "reference.glb", "body.json", "target.bin", "creature.toml"}) {
    EXPECT_EQ(io::read_file(one / name), io::read_file(two / name)) << name;
  }
  EXPECT_EQ(motion_bytes(one), motion_bytes(two));
}

/// Where that is asked for a plan holds on to the clip's shape more firmly, and replays go by it.
TEST(Convert, HoldsOnToTheClipsShapeAsFirmlyAsIsAsked) {
  const TemporaryDirectory directory;
  const auto made = [&](const std::string& name, const std::string& option) {
    EXPECT_EQ(convert(directory.path, kSmallClip, name, "--nodes 100 " + option).exit_code, 0);
    return report_of(directory.path / name)["replay"]["closed_loop"];
  };
  const json usual = made("usual", ""), firm = made("firm", "--firmness 10");
  EXPECT_LT(firm["clip_shape_rms_length"], 0.9 * usual["clip_shape_rms_length"].get<double>());
  EXPECT_LT(firm["slip_per_stance_length"], usual["slip_per_stance_length"]);
  EXPECT_EQ(firm["external_assist_mg"], 0);
  EXPECT_NE(io::read_file(directory.path / "usual" / "creature.toml").find("firmness = 1.0"), std::string::npos);
  EXPECT_NE(io::read_file(directory.path / "firm" / "creature.toml").find("firmness = 10.0"), std::string::npos);
  const std::string motion = motion_bytes(directory.path / "firm");
  EXPECT_EQ(hydrostat_in(directory.path, "replay firm --quiet").exit_code, 0);
  EXPECT_EQ(motion_bytes(directory.path / "firm"), motion);
}

/// What of the correction comes back in every cycle is the signals' own then, and they keep the creature up by themselves for longer.
TEST(Convert, PolishesTheSignals) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  convert(directory.path, kSmallClip, "creature", kSmallOptions);
  const json before = report_of(creature)["replay"];
  EXPECT_FALSE(report_of(creature).contains("polish"));
  ASSERT_EQ(convert(directory.path, kSmallClip, "creature", std::string(kSmallOptions) + "--polish on").exit_code, 0);
  const json report = report_of(creature), after = report["replay"], told = report["polish"];
  EXPECT_TRUE(fs::exists(creature / "path.bin"));
  EXPECT_EQ(told["correction_rms_before"], before["closed_loop"]["correction_rms"]);
  EXPECT_EQ(told["correction_rms_after"], after["closed_loop"]["correction_rms"]);
  EXPECT_LT(told["correction_rms_after"], told["correction_rms_before"].get<double>() / 3);
  ASSERT_TRUE(before["open_loop"]["fell"]);
  EXPECT_EQ(told["open_loop_s_before"], before["open_loop"]["fall_time_s"]);
  EXPECT_GE(told["open_loop_s_after"], 2 * told["open_loop_s_before"].get<double>());
  EXPECT_LT(after["closed_loop"]["shape_rms_length"], before["closed_loop"]["shape_rms_length"].get<double>() + 1e-3);
  EXPECT_EQ(after["closed_loop"]["external_assist_mg"], 0);
  EXPECT_EQ(report["signals"]["harmonics"], json::parse(io::read_file(creature / "signals.json"))["harmonics"]);

  const std::string motion = motion_bytes(creature);  // what is loaded again goes the same way
  hydrostat_in(directory.path, "replay creature --quiet");
  EXPECT_EQ(motion_bytes(creature), motion);
  EXPECT_EQ(report_of(creature)["polish"], told);
  io::write_file(creature / "path.bin", "of another kind");
  const Outcome damaged = hydrostat_in(directory.path, "replay creature --quiet");
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_NE(damaged.err.find("path.bin"), std::string::npos) << damaged.err;
}

/// Which entries of the stage cache are the same in both.
std::set<std::string> stages_kept(const std::set<std::string>& before, const std::set<std::string>& after) {
  std::set<std::string> kept;
  for (const std::string& entry : before) {
    if (after.contains(entry)) kept.insert(entry.substr(0, entry.find('-')));
  }
  return kept;
}

TEST(Convert, RedoesOnlyWhatAChangedOptionReaches) {
  const TemporaryDirectory directory;
  const fs::path cache = directory.path / "creature" / "cache";
  const std::string options = kSmallOptions;
  using Stages = std::set<std::string>;
  convert(directory.path, kSmallClip, "creature", options);
  const std::set<std::string> first = names_in(cache);
  EXPECT_EQ(stages_kept(first, first), (Stages{"body", "coupling", "preparation", "inverse_dynamics", "wobble", "replay"}));
  const std::string motion = motion_bytes(directory.path / "creature");
  const double solving = report_of(directory.path / "creature")["timing_s"]["inverse_dynamics"];

  convert(directory.path, kSmallClip, "creature", options);
  EXPECT_EQ(names_in(cache), first);
  EXPECT_EQ(motion_bytes(directory.path / "creature"), motion);
  EXPECT_LT(report_of(directory.path / "creature")["timing_s"]["inverse_dynamics"], 0.5 * solving);

  convert(directory.path, kSmallClip, "creature", options + "--limit 0.15");
  const std::set<std::string> limited = names_in(cache);
  EXPECT_EQ(stages_kept(first, limited), (Stages{"body", "coupling", "preparation"}));

  convert(directory.path, kSmallClip, "creature", options + "--limit 0.15 --seed 3");
  const std::set<std::string> seeded = names_in(cache);
  EXPECT_EQ(stages_kept(limited, seeded), (Stages{"body", "coupling", "preparation", "inverse_dynamics", "wobble"}));

  convert(directory.path, kSmallClip, "creature", options + "--limit 0.15 --friction 0.7");
  EXPECT_EQ(stages_kept(seeded, names_in(cache)), (Stages{"body", "coupling"}));

  convert(directory.path, kSmallClip, "afresh", options + "--limit 0.15 --friction 0.7");
  EXPECT_EQ(motion_bytes(directory.path / "creature"), motion_bytes(directory.path / "afresh"));
}

TEST(Convert, MarksACreatureThatFalls) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  // A dog of three centimetres that stays in the air as long as a large one: it would have to leap over five times its length.
  const std::string flea = std::string(kSmallOptions) + "--height 0.03";
  convert(directory.path, kSmallClip, "creature", kSmallOptions);
  std::ofstream(creature / "replay.glb") << "of an earlier run that stayed up";
  std::ofstream(creature / "notes.txt") << "the user's own";
  const Outcome outcome = convert(directory.path, "boxdog_jump.glb", "creature", flea);
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err.find("creature: replay: the creature fell: at "), 0U) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1);
  EXPECT_TRUE(fs::exists(creature / "failed.glb"));
  EXPECT_FALSE(fs::exists(creature / "replay.glb"));
  EXPECT_TRUE(fs::exists(creature / "notes.txt"));
  const json run = report_of(creature)["replay"]["closed_loop"];
  EXPECT_EQ(report_of(creature)["outcome_ok"], false);
  EXPECT_EQ(run["fell"], true);
  EXPECT_GT(run["fall_time_s"], 0);
  EXPECT_NE(run["fall_cause"].get<std::string>().find("limb '"), std::string::npos);
}

TEST(Convert, KeepsTheLayersOfASignalFile) {
  const TemporaryDirectory directory;
  convert(directory.path, kSmallClip, "creature", kSmallOptions);
  hydrostat_in(directory.path, "signals creature gain --bone 'head*' --factor 0.5 --name softer");
  convert(directory.path, kSmallClip, "creature", std::string(kSmallOptions) + "--limit 0.15");
  EXPECT_NE(hydrostat_in(directory.path, "signals creature layers").out.find("'softer'"), std::string::npos);
}

/// Those of a file that was worked on stay, with a warning; another clip goes without.
TEST(Convert, KeepsTheLayersOfTheSameClipAlone) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  const auto warnings_of = [&](const std::string& clip) {
    hydrostat_in(directory.path, "convert " + clip + " -o creature --quiet " + kSmallOptions);
    return report_of(creature)["warnings"].dump();
  };
  const auto layers = [&] { return hydrostat_in(directory.path, "signals creature layers").out; };
  const std::string trot = io::read_file(fs::path(HYDROSTAT_SAMPLES) / kSmallClip);
  io::write_file(directory.path / "clip.fbx", trot);
  warnings_of("clip.fbx");
  hydrostat_in(directory.path, "signals creature gain --factor 1 --name softer");
  EXPECT_EQ(warnings_of("clip.fbx").find("layers: "), std::string::npos);
  EXPECT_NE(layers().find("'softer'"), std::string::npos);
  io::write_file(directory.path / "clip.fbx", trot + " ");
  EXPECT_NE(warnings_of("./clip.fbx").find("layers: ./clip.fbx has changed since the signals were edited"), std::string::npos);
  EXPECT_NE(layers().find("'softer'"), std::string::npos);
  io::write_file(directory.path / "other.fbx", trot + "  ");
  EXPECT_NE(warnings_of("other.fbx").find("layers: the signals' edits (1) were left out, for they are of the clip 'Scene' of "), std::string::npos);
  EXPECT_EQ(layers().find("'softer'"), std::string::npos);
  EXPECT_EQ(warnings_of("clip.fbx").find("layers: "), std::string::npos);  // none are left
}

TEST(Convert, LetsAnotherBodyGoForEachSeed) {
  const TemporaryDirectory directory;
  const auto made = [&](const std::string& seed) {
    convert(directory.path, kSmallClip, "creature", std::string(kSmallOptions) + "--seed " + seed);
    return motion_bytes(directory.path / "creature");
  };
  const std::string planned = made("0"), first = made("1"), second = made("2");
  EXPECT_NE(planned, first);
  EXPECT_NE(first, second);
  EXPECT_EQ(made("1"), first);
  const std::string warnings = report_of(directory.path / "creature")["warnings"].dump();
  EXPECT_NE(warnings.find("--seed 1: the body that was let go has"), std::string::npos) << warnings;
}

TEST(Convert, PrintsTheReportForMachines) {
  const TemporaryDirectory directory;
  const Outcome outcome = convert(directory.path, kSmallClip, "creature", std::string(kSmallOptions) + "--json");
  EXPECT_EQ(outcome.out, io::read_file(directory.path / "creature" / "report.json"));
}

TEST(Convert, RefusesBadInputInOneLineAndLeavesNothing) {
  const TemporaryDirectory directory;
  std::ofstream(directory.path / "text.fbx") << "this is no clip\n";
  std::ofstream(directory.path / "file") << "not a directory\n";
  fs::create_directory(directory.path / "mine");
  std::ofstream(directory.path / "mine" / "letter.txt") << "not a creature\n";
  const std::set<std::string> before = names_in(directory.path);
  const std::string trot = in_quotes(fs::path(HYDROSTAT_SAMPLES) / "boxdog_trot.fbx");
  const auto expect = [&](const std::string& arguments, int exit_code, const std::string& told) {
    SCOPED_TRACE(arguments);
    const Outcome outcome = hydrostat_in(directory.path, "convert --quiet " + arguments);
    EXPECT_EQ(outcome.exit_code, exit_code);
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find(told), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_EQ(names_in(directory.path), before);
  };
  expect("missing.fbx -o out", 1, "missing.fbx: ");
  expect("text.fbx -o out", 1, "text.fbx: ");
  expect(trot + " -o out --clip Fly", 1, "clip 'Fly': there is no such clip. Choose one of: 0 'Scene'.");
  expect(trot + " -o file", 1, "file: is a file where a creature's directory belongs.");
  expect(trot + " -o mine", 1, "mine: ");
  expect(trot + " -o /proc/out", 1, "/proc/out: the directory cannot be written");
  expect(trot, 2, "--out is required");
  expect(trot + " -o out --height 0", 2, "option --height: Value 0 not in range 0.01 to 1000.");
  expect(trot + " -o out --height nan", 2, "option --height: Value nan not in range 0.01 to 1000.");
  expect(trot + " -o out --nodes 5", 2, "option --nodes: Value 5 not in range 20 to 5000.");
  expect(trot + " -o out --nodes 40.5", 2, "option --nodes: '40.5' is not a whole number");
  expect(trot + " -o out --limit 2", 2, "option --limit: Value 2 not in range 0.01 to 0.9.");
  expect(trot + " -o out --limit most", 2, "option --limit: Value most not in range 0.01 to 0.9.");
  expect(trot + " -o out --firmness 0.5", 2, "option --firmness: Value 0.5 not in range 1 to 100.");
  expect(trot + " -o out --firmness firm", 2, "option --firmness: Value firm not in range 1 to 100.");
  expect(trot + " -o out --friction -1", 2, "option --friction: Value -1 not in range 0.05 to 5.");
  expect(trot + " -o out --threads 0", 2, "option --threads: Value 0 not in range 1 to 256.");
  expect(trot + " -o out --element cube", 2, "option --element: cube not in");
  expect(trot + " -o out --material jelly", 2, "option --material: jelly not in");
  expect(trot + " -o out --element hex --material springs", 2,
         "option --material: springs lie along the edges of tets. Give another");
  expect(trot + " -o out --calibrated", 2,
         "option --calibrated: only tets of finite elements are calibrated. Give --material");
  expect(trot + " -o out --method magic", 2, "option --method: magic not in");
  expect(trot + " -o out --root-motion sideways", 2, "option --root-motion: sideways not in");
}

TEST(Convert, MakesCreaturesOfFiniteElementsThatReplayAsTheyWere) {
  for (const auto& [options, element, material, corners] :
       {std::tuple("--element hex", "hex", "stable_neo_hookean", 8),
        std::tuple("--material corotated_linear", "tet", "corotated_linear", 4)}) {
    SCOPED_TRACE(options);
    const TemporaryDirectory directory;
    convert(directory.path, kSmallClip, "creature", kSmallOptions + std::string(options));
    const fs::path creature = directory.path / "creature";
    const json report = report_of(creature), body = json::parse(io::read_file(creature / "body.json"));
    EXPECT_EQ(report["accuracy"]["element"], element);
    EXPECT_EQ(report["accuracy"]["material"], material);
    EXPECT_EQ(report["body"]["elements"], body.at("elements").size());
    EXPECT_EQ(report["body"]["constraints"], body.at("edges").size());
    EXPECT_EQ(body.at("elements").at(0).size(), corners);
    EXPECT_LE(report["inverse"]["root_residual_mg"], 0.02);
    EXPECT_LE(report["replay"]["closed_loop"]["momentum_residual_mg"], kMomentum);
    EXPECT_LE(report["replay"]["closed_loop"]["angular_residual_mgl"], kMomentum);
    const std::string motion = motion_bytes(creature);
    EXPECT_EQ(hydrostat_in(directory.path, "replay creature --quiet --threads 1").exit_code,
              report["replay"]["closed_loop"]["fell"] ? 3 : 0);
    EXPECT_EQ(motion_bytes(creature), motion);
    // From the cache the body comes as it was made.
    fs::remove(creature / "report.json");
    convert(directory.path, kSmallClip, "creature", kSmallOptions + std::string(options) + " --limit 0.5");
    const json again = report_of(creature);
    EXPECT_EQ(again["body"], report["body"]);
  }
}

/// Small errors of short windows add up: what keeps within them has to keep its feet too, where the finest setting does.
TEST(Convert, TakesTheCheapestWithinAnErrorKeepsItsFeetAndReplaysByIt) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  const Outcome outcome = convert(directory.path, kSmallClip, "creature", std::string(kSmallOptions) + "--max-error 2%");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("of the processor for a simulated second"), std::string::npos) << outcome.out;
  const nlohmann::json report = report_of(creature), accuracy = report["accuracy"];
  EXPECT_EQ(accuracy["max_error_length"], 0.02);
  EXPECT_GT(accuracy["ms_per_sim_s"], 0);
  EXPECT_LE(accuracy["estimated_error_length"], 0.02);
  EXPECT_GT(accuracy["work_saved"], 0);
  EXPECT_FALSE(report["replay"]["closed_loop"]["fell"]);
  EXPECT_LT(report["signals"]["harmonics"], 15);  // of all
  EXPECT_NE(io::read_file(creature / "accuracy.csv").find("harmonics"), std::string::npos);
  EXPECT_NE(io::read_file(creature / "report.html").find("What accuracy costs: "), std::string::npos);
  const std::string motion = motion_bytes(creature);
  hydrostat_in(directory.path, "replay creature --quiet");
  EXPECT_EQ(motion_bytes(creature), motion);
  EXPECT_NE(io::read_file(creature / "report.html").find("What accuracy costs: "), std::string::npos);
}

/// Springs alone are another body: shorter steps of them do not show what they err by.
TEST(Convert, HoldsAGivenMethodAgainstAnAccurateOne) {
  const TemporaryDirectory directory;
  const Outcome outcome = convert(directory.path, kSmallClip, "creature", std::string(kSmallOptions) + "--method spring --max-error 0.3%");
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err.find("no setting that was tried stays within 0.3 %"), std::string::npos) << outcome.err;
  EXPECT_GT(report_of(directory.path / "creature")["accuracy"]["estimated_error_length"], 0.005);
}

/// The nodes of the rows of accuracy.csv, the largest number.
int most_nodes_tried(const fs::path& creature) {
  std::istringstream lines(io::read_file(creature / "accuracy.csv"));
  std::string line;
  std::getline(lines, line);
  int most = 0;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    std::string method, element, nodes;
    std::getline(std::getline(std::getline(fields, method, ','), element, ','), nodes, ',');
    most = std::max(most, std::stoi(nodes));
  }
  return most;
}

TEST(Convert, TakesACoarserMeshWhereItKeepsTheErrorAndRemembersIt) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  const Outcome outcome = convert(directory.path, kSmallClip, "creature", "--max-error 4%");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json report = report_of(creature);
  const int nodes = report["body"]["nodes"];
  EXPECT_LT(nodes, 0.8 * most_nodes_tried(creature));
  EXPECT_LE(report["accuracy"]["estimated_error_length"], 0.04);
  EXPECT_LE(report["replay"]["closed_loop"]["world_rms_length"], 0.05);
  EXPECT_NE(outcome.out.find("on " + std::to_string(nodes) + " nodes"), std::string::npos) << outcome.out;
  const std::string motion = motion_bytes(creature);
  ASSERT_EQ(convert(directory.path, kSmallClip, "creature", "--max-error 4%").exit_code, 0);
  const json again = report_of(creature);
  EXPECT_FALSE(again["timing_s"].contains("accuracy"));
  EXPECT_EQ(again["accuracy"], report["accuracy"]);
  EXPECT_EQ(motion_bytes(creature), motion);
  hydrostat_in(directory.path, "replay creature --quiet");
  EXPECT_EQ(motion_bytes(creature), motion);
  // What cannot be written is told as such, and not taken for a mesh that cannot be solved.
  const fs::path coarser = creature / "cache" / "coarser";
  fs::remove_all(coarser);
  io::write_file(coarser, "in the way");
  const Outcome blocked = convert(directory.path, kSmallClip, "creature", "--max-error 4%");
  EXPECT_EQ(blocked.exit_code, 1);
  EXPECT_TRUE(blocked.err.starts_with("creature/cache/coarser")) << blocked.err;
  EXPECT_NE(blocked.err.find("cannot be written"), std::string::npos) << blocked.err;
  EXPECT_EQ(motion_bytes(creature), motion);
}

TEST(Convert, LeavesAnExistingCreatureAsItWasWhenTheDiskIsFull) {
  const TemporaryDirectory directory;
  convert(directory.path, kSmallClip, "creature", kSmallOptions);
  const fs::path creature = directory.path / "creature";
  const std::set<std::string> files = names_in(creature), cache = names_in(creature / "cache");
  const std::string report = io::read_file(creature / "report.json"), signals = io::read_file(creature / "signals.json");
  // No file may grow beyond 64 blocks of 512 or 1024 bytes: as a full disk, to write(2).
  const Outcome outcome =
      hydrostat_in(directory.path, "--version && ulimit -f 64 && " + in_quotes(HYDROSTAT_BINARY) + " convert " +
                                       in_quotes(fs::path(HYDROSTAT_SAMPLES) / kSmallClip) + " -o creature --quiet --nodes 60 2>message");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(io::read_file(directory.path / "message").find("creature/cache/body-"), 0U) << io::read_file(directory.path / "message");
  EXPECT_EQ(names_in(creature), files);
  EXPECT_EQ(names_in(creature / "cache"), cache);
  EXPECT_EQ(io::read_file(creature / "report.json"), report);
  EXPECT_EQ(io::read_file(creature / "signals.json"), signals);
  EXPECT_EQ(names_in(directory.path), (std::set<std::string>{"creature", "message"}));
}

}  // namespace
}  // namespace hydrostat::convert_test

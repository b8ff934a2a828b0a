#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "io/load_creature.h"
#include "retarget/performance.h"
#include "tests/e2e/made_creature.h"
#include "tests/e2e/trace_audit.h"

namespace hydrostat::samples_test {
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
constexpr double kMomentum = 1e-6;         // [mg]
constexpr double kAngularMomentum = 1e-3;  // [mgL]: the moment of gravity is taken at the row's middle
constexpr double kContactMoment = 0.03;    // [mgL]: of the forces at the row's middle, between which the nodes shake
constexpr double kPathMiss = 0.3;          // of the way: landing and standing shake within a row
constexpr double kNearGround = 0.002;      // [per L]

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

/// A sample's creature, made by the default settings.
class Samples : public testing::Test {
 protected:
  void expect_creature(const Gate& gate) {
    SCOPED_TRACE(gate.clip);
    const Outcome outcome = convert(directory_.path, gate.clip, "creature");
    EXPECT_EQ(outcome.exit_code, gate.stays_up ? 0 : 3) << outcome.err;
    const fs::path creature = directory_.path / "creature";
    ASSERT_TRUE(fs::exists(creature));
    expect_contract(creature, gate.stays_up);
    expect_gate(creature, gate);
    expect_honest_trace(directory_.path, "creature");
    if (gate.apex > 0) expect_jump(creature, directory_.path / "trace", gate.apex);
    if (gate.has_levels) expect_coarse_level(directory_.path);
    creature_ = io::load_creature(creature);
  }
  /// A body up to a tenth off the plan in mass, friction and stiffness, shoved by 0.1 m/s from one of four sides.
  retarget::ReplayReport let_go(unsigned seed, double cycles, bool keep_way = true) const {
    const retarget::Performer& performer = creature_.target.performer;
    retarget::PerformOptions options;
    options.replay.duration_s = cycles * performer.prepared.target.duration_s();
    options.replay.keep_way = keep_way;
    options.baselines = false;
    options.variation = 0.1;
    options.feedback = io::feedback_of(creature_.record);
    options.seed = seed;
    const double angle = 0.5 * M_PI * seed;
    retarget::Push shove;
    shove.delta_v = 0.1 * Eigen::Vector3d(std::cos(angle), 0, std::sin(angle));
    options.replay.pushes = {shove};
    return retarget::perform(performer, creature_.signals, options).main().report;
  }
  void expect_gates_off_the_plan(unsigned bodies, double cycles, double most_shape) const {
    for (unsigned seed = 1; seed <= bodies; ++seed) {
      const retarget::ReplayReport run = let_go(seed, cycles);
      EXPECT_FALSE(run.fell) << "body " << seed << ": " << run.fall_cause;
      EXPECT_LT(run.shape_rms_length, most_shape) << "body " << seed;
      EXPECT_LT(std::abs(run.drift_per_cycle_length), 0.003) << "body " << seed;
      EXPECT_NEAR(run.travel_per_cycle_length / run.clip_travel_per_cycle_length, 1, 0.08) << "body " << seed;
      EXPECT_LT(run.held_slip_per_stance_length, 0.03) << "body " << seed;
      EXPECT_LT(std::max(run.momentum_residual_mg, run.angular_residual_mgl), 1e-6) << "body " << seed;
      EXPECT_EQ(run.external_assist_mg, 0) << "body " << seed;
    }
  }

 private:
  const TemporaryDirectory directory_;
  io::LoadedCreature creature_;
};

TEST_F(Samples, TheWormCrawlsAsPlannedAndATenthOffThePlanByWhatIsFedBackFromCycleToCycle) {
  ASSERT_NO_FATAL_FAILURE(expect_creature(kGates[0]));
  expect_gates_off_the_plan(/*bodies=*/2, /*cycles=*/8, 0.005);
  EXPECT_GT(let_go(1, 5, /*keep_way=*/false).drift_per_cycle_length, 0.005);
}

TEST_F(Samples, TheDogTrotsAsPlannedAndATenthOffThePlanForFiftyCycles) {
  ASSERT_NO_FATAL_FAILURE(expect_creature(kGates[1]));
  expect_gates_off_the_plan(/*bodies=*/2, /*cycles=*/50, 0.01);
}

TEST_F(Samples, TheDogJumps) { expect_creature(kGates[2]); }

}  // namespace
}  // namespace hydrostat::samples_test

#include <gtest/gtest.h>

#include <map>

#include "tests/e2e/made_creature.h"
#include "tests/e2e/trace_audit.h"

namespace hydrostat::replay_test {
namespace {

namespace fs = std::filesystem;

/// A small creature, made anew for each test.
class Replay : public testing::Test {
 protected:
  void SetUp() override {
    convert(directory_.path, kSmallClip, "creature", kSmallOptions);
    ASSERT_TRUE(fs::exists(creature_ / "body.json"));
  }
  Outcome replay(const std::string& options) const { return hydrostat_in(directory_.path, "replay creature --quiet " + options); }
  TraceAudit traced(const std::string& options) const {
    replay("-o motion.glb --trace trace " + options);
    return audit_trace(directory_.path / "trace", creature_);
  }

  TemporaryDirectory directory_;
  fs::path creature_ = directory_.path / "creature";
};

TEST_F(Replay, IsTheConversionsOwnAndNeedsNoCache) {
  const std::string motion = motion_bytes(creature_);
  const nlohmann::json before = report_of(creature_);
  fs::remove_all(creature_ / "cache");
  replay("");
  EXPECT_EQ(motion_bytes(creature_), motion);
  const nlohmann::json after = report_of(creature_);
  for (const char* group : {"source", "body", "coupling", "preparation", "inverse", "signals", "warnings"}) {
    EXPECT_EQ(after[group], before[group]) << group;
  }
  EXPECT_EQ(after["replay"]["closed_loop"]["cycles"], before["replay"]["closed_loop"]["cycles"]);
}

TEST_F(Replay, PlaysTheLayersOfTheSignals) {
  const std::string motion = motion_bytes(creature_);
  hydrostat_in(directory_.path, "signals creature gain --bone '*' --factor 0.7");
  replay("");
  EXPECT_NE(motion_bytes(creature_), motion);
  hydrostat_in(directory_.path, "signals creature reset");
  replay("");
  EXPECT_EQ(motion_bytes(creature_), motion);
}

TEST_F(Replay, OnOtherLevelsIsTheSameEachTimeAndRefusesWhatCannotBe) {
  const std::string motion = motion_bytes(creature_);
  const auto level = [&](const std::string& options, const std::string& file) {
    const Outcome outcome = replay("--duration 0.3 -o " + file + " " + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  };
  const std::string told = level("--lod 60 --threads 1", "one.glb");
  EXPECT_NE(told.find("(solved on "), std::string::npos) << told;
  level("--lod 60 --threads 2", "two.glb");
  bool is_warned = false, is_near = false;
  for (const int wished : {20, 24, 28, 60}) {
    const std::string words = replay("--duration 0.1 -o wished.glb --lod " + std::to_string(wished)).out;
    ASSERT_NE(words.find(": on "), std::string::npos) << words;
    const int nodes = std::stoi(words.substr(words.find(": on ") + 5));
    const bool is_far = nodes > 1.5 * wished || wished > 1.5 * nodes;
    EXPECT_EQ(words.find("level: the control mesh has " + std::to_string(nodes) + " nodes where --lod asks for ") != std::string::npos, is_far) << words;
    (is_far ? is_warned : is_near) = true;
  }
  EXPECT_TRUE(is_warned && is_near);
  EXPECT_EQ(io::read_file(directory_.path / "one.glb"), io::read_file(directory_.path / "two.glb"));
  const Outcome too_little = replay("--lod auto --budget 0.001ms");
  EXPECT_EQ(too_little.exit_code, 2);
  const auto told_between = [&too_little](const std::string& before, const std::string& after) {
    const std::size_t begin = too_little.err.find(before) + before.size();
    return too_little.err.substr(begin, too_little.err.find(after, begin) - begin);
  };
  const std::string nodes = told_between("keeps its way, of ", " nodes"), possible = told_between("Allow ", ".\n");
  EXPECT_NE(level("--lod auto --budget " + possible, "cheap.glb").find("on " + nodes + " nodes"), std::string::npos) << too_little.err;
  const Outcome fallen = replay("--duration 1 -o fallen.glb --lod auto --budget 1ms");
  EXPECT_EQ(fallen.exit_code, 3) << fallen.out;
  EXPECT_NE(fallen.err.find("keeps its way, of " + nodes + " nodes, takes "), std::string::npos) << fallen.err;
  EXPECT_TRUE(fallen.err.ends_with(" a frame: give --budget " + possible + ".\n")) << fallen.err;
  EXPECT_EQ(std::count(fallen.err.begin(), fallen.err.end(), '\n'), 1) << fallen.err;
  EXPECT_EQ(motion_bytes(creature_), motion);
  for (const char* options : {"--lod auto", "--lod 60 --budget 2ms", "--budget 2ms", "--lod 3", "--lod 60.5", "--lod auto --budget soon"})
    EXPECT_EQ(replay(options).exit_code, 2) << options;
  fs::remove(creature_ / "rig.bin");
  const Outcome old = replay("--lod 60");
  EXPECT_EQ(old.exit_code, 1);
  EXPECT_NE(old.err.find("rig.bin"), std::string::npos) << old.err;
}

TEST_F(Replay, KeepsItsFeetAndItsWayOnAFinerMeshThatFeelsAnEdit) {
  const Outcome outcome = replay("--lod 110 --cycles 8 --json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json report = report_of(creature_), run = report["replay"]["closed_loop"];
  EXPECT_GT(report["level"]["nodes"], 2 * report["level"]["solved_nodes"].get<int>());
  EXPECT_FALSE(run["fell"]);
  EXPECT_NEAR(run["travel_per_cycle_length"].get<double>() / run["clip_travel_per_cycle_length"].get<double>(), 1, 0.05);
  const auto motion = [&](const std::string& file) {
    replay("--lod 60 --duration 0.2 -o " + file);
    return io::read_file(directory_.path / file);
  };
  const std::string plain = motion("plain.glb");
  hydrostat_in(directory_.path, "signals creature gain --bone '*' --factor 0.9");
  EXPECT_NE(motion("edited.glb"), plain);
}

TEST_F(Replay, WobblesInThePictureAlone) {
  const auto motion = [&](const std::string& name, const std::string& options) {
    const Outcome outcome = replay("--duration 0.5 -o " + name + ".glb --trace " + name + " " + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return io::read_file(directory_.path / (name + ".glb"));
  };
  const std::string on = motion("on", "--wobble on --threads 1"), off = motion("off", "--wobble off");
  EXPECT_NE(on.find("wobble 1"), std::string::npos);
  EXPECT_EQ(off.find("wobble 1"), std::string::npos);
  EXPECT_EQ(motion("again", "--wobble on --threads 2"), on);
  for (const std::string& file : names_in(directory_.path / "on"))
    EXPECT_EQ(io::read_file(directory_.path / "on" / file), io::read_file(directory_.path / "off" / file)) << file;
  EXPECT_NE(motion("level", "--lod 60 --wobble on").find("wobble 1"), std::string::npos);
  io::write_file(creature_ / "wobble.bin", "of another kind");
  const Outcome damaged = replay("--duration 0.5 -o motion.glb");
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_NE(damaged.err.find("wobble.bin"), std::string::npos) << damaged.err;
  fs::remove(creature_ / "wobble.bin");
  EXPECT_EQ(motion("bare", ""), off);
  fs::remove(creature_ / "rig.bin");
  EXPECT_EQ(motion("without_rig", "--wobble off"), off);
  EXPECT_EQ(replay("--wobble on -o motion.glb").exit_code, 1);
  EXPECT_EQ(replay("--wobble perhaps").exit_code, 2);
}

TEST_F(Replay, RefusesWhatCannotBeWrittenBeforeItMeasuresAnything) {
  io::write_file(directory_.path / "file", "");
  fs::create_directory(directory_.path / "motion.glb");
  const std::map<std::string, std::string> faults{{"-o file/motion.glb", "cannot be written: Not a directory"},
                                                  {"-o motion.glb", "cannot be written: Is a directory"},
                                                  {"--trace file/trace", "cannot be written: Not a directory"},
                                                  {"--trace creature", "the folder holds something that is not a trace"}};
  for (const auto& [output, fault] : faults) {
    const Outcome outcome = replay(output + " --lod auto --budget 1e-6ms");  // which no level meets, as measuring would tell
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.err.find(fault), std::string::npos) << outcome.err;
  }
}

TEST_F(Replay, MayLeaveItsTraceInTheCreature) {
  const Outcome outcome = replay("--duration 0.3 --trace creature/trace");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(creature_ / "trace" / "time.npy"));
}

TEST_F(Replay, WithAFileOfItsOwnLeavesTheCreatureAlone) {
  const std::string motion = motion_bytes(creature_), report = io::read_file(creature_ / "report.json");
  const std::set<std::string> files = names_in(creature_);
  const Outcome outcome = replay("--cycles 1 -o one.glb");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(directory_.path / "one.glb"));
  EXPECT_EQ(motion_bytes(creature_), motion);
  EXPECT_EQ(io::read_file(creature_ / "report.json"), report);
  EXPECT_EQ(names_in(creature_), files);
}

TEST_F(Replay, RunsForAsLongAsAskedAndWithoutTheCorrectorHasNoClosedLoop) {
  replay("--cycles 2");
  EXPECT_NEAR(report_of(creature_)["replay"]["closed_loop"]["cycles"].get<double>(), 2, 1e-9);
  replay("--duration 0.5");
  EXPECT_NEAR(report_of(creature_)["replay"]["closed_loop"]["duration_s"].get<double>(), 0.5, 1e-9);

  replay("--cycles 1 --open-loop");
  const nlohmann::json runs = report_of(creature_)["replay"];
  EXPECT_TRUE(runs["closed_loop"].is_null());
  EXPECT_EQ(runs["open_loop"]["correction_rms"], 0);
  EXPECT_NEAR(runs["open_loop"]["cycles"].get<double>(), 1, 1e-9);
}

TEST_F(Replay, PushesByAForceThatTheTraceTells) {
  const TraceAudit audit = traced("--duration 1 --push t=0.5,dv=0.2:0:0");
  EXPECT_NEAR(audit.effect_mg, 0.2 / 0.1 / 9.81, 1e-9);
  EXPECT_LE(audit.momentum_mg, 1e-6);
  EXPECT_EQ(audit.correction_ns, 0);
}

/// A side wind on a slope knee-deep in water, and a ball that rolls along.
constexpr const char* kWorld = R"([ground]
slope_deg = 5.0
[water]
level_m = 0.15
[air]
velocity_m_s = [12.0, 0.0, 3.0]
[[obstacle]]
shape = "ball"
size_m = 0.4
position_m = [1.0, 0.3, 0.2]
[[obstacle.move]]
velocity_m_s = [-1.0, -0.1, 0.0]
[[push]]
time_s = 0.2
delta_v_m_s = [0.0, 0.0, 0.1]
)";

TEST_F(Replay, InAWorldBooksAllThatActsOnTheBody) {
  io::write_file(directory_.path / "world.toml", kWorld);
  const TraceAudit audit = traced("--duration 1 --scene world.toml");
  EXPECT_LE(audit.momentum_mg, 1e-6);
  EXPECT_LE(audit.angular_mgl, 1e-3);  // the moment of gravity is taken at the row's middle
  EXPECT_GT(audit.effect_mg, 0.05);
  EXPECT_EQ(audit.correction_ns, 0);
}

TEST_F(Replay, WithoutWeightOrGroundIsMovedByWhatIsLeftAlone) {
  const std::string no_weight = "gravity_m_s2 = [0.0, 0.0, 0.0]\n", no_ground = "[effects]\nground = \"off\"\n", push = " --push t=0.1,dv=0.3:0.5:0";
  const std::vector<std::pair<std::string, std::string>> runs{
      {no_weight + no_ground, ""}, {no_weight + no_ground, push}, {no_ground, " --open-loop"}, {no_ground, push}, {no_weight, ""}};
  for (const auto& [world, options] : runs) {
    SCOPED_TRACE(world + options);
    io::write_file(directory_.path / "world.toml", world);
    const Outcome outcome = replay("-o motion.glb --trace trace --duration 0.3 --scene world.toml" + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const TraceAudit audit = audit_trace(directory_.path / "trace", creature_, {0, world == no_ground ? -9.81 : 0, 0});
    EXPECT_NEAR(audit.duration_s, 0.3, 1e-9);
    EXPECT_LE(audit.momentum_mg, 1e-9);
    EXPECT_LE(audit.angular_mgl, world == no_ground ? 1e-3 : 1e-6);  // gravity's moment is taken at the row's middle
    EXPECT_EQ(audit.effect_mg > 0, options == push);
    EXPECT_EQ(audit.contact_mg > 0, world == no_weight);  // where there is ground it pushes from it
    EXPECT_EQ(audit.correction_ns, 0);
  }
}

TEST_F(Replay, GoesInTheSceneThatTheCreatureWasMadeWith) {
  io::write_file(directory_.path / "world.toml", kWorld);
  const std::string flat = motion_bytes(creature_);
  convert(directory_.path, kSmallClip, "creature", std::string(kSmallOptions) + "--scene world.toml");
  const std::string motion = motion_bytes(creature_);
  EXPECT_NE(motion, flat);
  for (const char* name : {"ground", "obstacles", "water", "air_drag", "pushes"}) {
    EXPECT_EQ(effect_of(creature_, name)["state"], "on") << name;
  }
  EXPECT_GT(effect_of(creature_, "water")["ms_per_sim_s"], 0);
  fs::remove(directory_.path / "world.toml");
  replay("");
  EXPECT_EQ(motion_bytes(creature_), motion);
  const Outcome told = hydrostat_in(directory_.path, "explain creature");
  EXPECT_NE(told.out.find("water         on"), std::string::npos) << told.out;
  EXPECT_EQ(hydrostat_in(directory_.path, "bench effects creature -o bench --duration 0.1").exit_code, 0);
  const std::string rows = io::read_file(directory_.path / "bench" / "effects.csv");
  for (const char* row : {"\nnone,", "\nobstacles,", "\nwater,", "\nair_drag,", "\npushes,", "\nembedding,", "\nall,"}) {
    EXPECT_NE(rows.find(row), std::string::npos) << row << rows;
  }
  io::write_file(directory_.path / "bad.toml", "[body]\nshape = \"cube\"\n");
  const Outcome refused = replay("-o motion.glb --scene bad.toml");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  convert(directory_.path, kSmallClip, "creature", kSmallOptions);
  EXPECT_EQ(motion_bytes(creature_), flat);
  EXPECT_FALSE(fs::exists(creature_ / "scene.toml"));
}

/// The farthest that a place where contact is tested gets along z [m].
double farthest_along_z(const fs::path& trace, const fs::path& creature) {
  const auto position = io::read_npy_double(trace / "position.npy");
  const nlohmann::json points = nlohmann::json::parse(io::read_file(creature / "body.json")).at("contact_points");
  const std::vector<std::vector<int>> nodes = points.at("nodes");
  const std::vector<std::vector<double>> weights = points.at("weights");
  double farthest = -1e300;
  for (std::size_t s = 0; s < position.shape[0]; ++s) {
    const Eigen::Matrix3Xd x = audit::points(position, s);
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      double z = 0;
      for (std::size_t k = 0; k < nodes[p].size(); ++k) z += weights[p][k] * x(2, nodes[p][k]);
      farthest = std::max(farthest, z);
    }
  }
  return farthest;
}

/// The trot walks toward +z, and into a wall that is told in the scene's places.
TEST_F(Replay, TellsInTheReportWhereThePlacesOfASceneCountFrom) {
  const std::string wall = "[[obstacle]]\nshape = \"box\"\nsize_m = [4.0, 4.0, 1.0]\nposition_m = [0.0, 0.5, 1.4]\n";
  const nlohmann::json flat = report_of(creature_)["source"]["scene_origin_m"];
  EXPECT_EQ(flat.at(1), 0);
  EXPECT_GT(std::abs(flat.at(2).get<double>()), 0.02);  // else it shows nothing
  for (const std::string ground : {"", "[ground]\nslope_deg = 6.0\nslope_heading_deg = -90.0\n"}) {
    SCOPED_TRACE(ground);
    io::write_file(directory_.path / "world.toml", wall + ground);
    replay("--duration 2 --trace trace --scene world.toml");
    const nlohmann::json origin = report_of(creature_)["source"]["scene_origin_m"];
    EXPECT_EQ(origin, flat);
    EXPECT_NEAR(farthest_along_z(directory_.path / "trace", creature_), origin.at(2).get<double>() + 0.9, 1e-3);
  }
}

TEST_F(Replay, LeavesTheCreaturesOwnMotionToTheReportThatTellsOfIt) {
  const std::string before = motion_bytes(creature_);
  fs::create_directory_symlink(creature_, directory_.path / "link");
  fs::create_symlink(creature_ / "replay.glb", directory_.path / "motion.glb");
  for (const char* out : {"creature/replay.glb", "creature/./replay.glb", "link/replay.glb", "motion.glb", "creature/reference.glb", "creature/failed.glb"}) {
    const Outcome outcome = replay("--duration 0.1 -o " + std::string(out));
    EXPECT_EQ(outcome.exit_code, 2) << out;
    EXPECT_NE(outcome.err.find("Leave --out out to have replay.glb and the report anew"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(motion_bytes(creature_), before);
  EXPECT_EQ(hydrostat_in(directory_.path, "replay link --quiet --duration 0.1 -o creature/replay.glb").exit_code, 2);
  EXPECT_EQ(replay("--duration 0.1 -o creature/mine.glb").exit_code, 0);
}

TEST_F(Replay, PutsAFallIntoFailedGlb) {
  const std::string blow = "--push t=0.3,dv=20:0:0";
  const Outcome aside = replay("-o motion.glb " + blow);
  EXPECT_EQ(aside.exit_code, 3);
  EXPECT_TRUE(fs::exists(directory_.path / "failed.glb"));
  EXPECT_FALSE(fs::exists(directory_.path / "motion.glb"));
  EXPECT_EQ(replay(blow).exit_code, 3);
  EXPECT_TRUE(fs::exists(creature_ / "failed.glb"));
  EXPECT_FALSE(fs::exists(creature_ / "replay.glb"));
  EXPECT_EQ(report_of(creature_)["replay"]["closed_loop"]["fell"], true);
}

TEST_F(Replay, TracesTheMeansOverLongerRows) {
  const TraceAudit fine = traced("--duration 1"), coarse = traced("--duration 1 --trace-rate 30");
  EXPECT_NEAR(coarse.fastest_row_s, 1.0 / 30, 1e-9);
  EXPECT_NEAR(coarse.slowest_row_s, 1.0 / 30, 1e-9);
  EXPECT_NEAR(coarse.duration_s, fine.duration_s, 1e-9);
  EXPECT_LE(fine.momentum_mg, 1e-6);
  EXPECT_LE(coarse.momentum_mg, 1e-6);
  EXPECT_LE(coarse.cone_excess_mg, 1e-9);
  EXPECT_LT(fine.path_miss, 0.7 * coarse.path_miss);  // positions follow velocities the better the shorter the rows
}

TEST_F(Replay, TakesTheCheapestStepWithinAnErrorAndSaysWhatCanBeTold) {
  const Outcome asked = replay("--duration 1 --max-error 2%");
  ASSERT_EQ(asked.exit_code, 0) << asked.err;
  const nlohmann::json accuracy = report_of(creature_)["accuracy"];
  EXPECT_EQ(accuracy["max_error_length"], 0.02);
  EXPECT_LE(accuracy["estimated_error_length"], 0.02);
  EXPECT_GT(accuracy["work_saved"], 0);
  EXPECT_NE(asked.out.find("by '" + accuracy["method"].get<std::string>() + "'"), std::string::npos) << asked.out;
  const std::string motion = motion_bytes(creature_);
  const Outcome too_small = replay("--max-error 0.00001%");
  EXPECT_EQ(too_small.exit_code, 2);
  EXPECT_NE(too_small.err.find("is only known within"), std::string::npos) << too_small.err;
  EXPECT_EQ(motion_bytes(creature_), motion);
}

TEST_F(Replay, RefusesWhatItCannotDoAndABodyThatIsNotItsOwn) {
  const auto expect = [&](const std::string& options, int exit_code, const std::string& told) {
    SCOPED_TRACE(options);
    const Outcome outcome = replay(options);
    EXPECT_EQ(outcome.exit_code, exit_code);
    EXPECT_NE(outcome.err.find(told), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  };
  const std::string motion = motion_bytes(creature_);
  expect("--duration 0", 2, "option --duration: Value 0 not in range 0.1 to 600.");
  expect("--duration 1 --cycles 1", 2, "excludes");
  expect("--push t=1", 2, "option --push: 't=1' lacks dv.");
  expect("--push dv=1:0:0", 2, "option --push: 'dv=1:0:0' lacks t.");
  expect("--push t=1,dv=1:0", 2, "has not three speeds in dv.");
  expect("--push t=1,dv=1:0:x", 2, "option --push dv: Value x not in range -100 to 100.");
  expect("--push t=99,dv=1:0:0", 2, "comes after the end of the replay.");
  expect("--trace-rate 60", 2, "--trace-rate requires --trace.");
  expect("--trace trace --trace-rate 70", 2, "option --trace-rate: 70 Hz is not a whole part of the 120 Hz");
  expect("--trace trace --trace-rate 240", 2, "option --trace-rate: 240 Hz is not a whole part of the 120 Hz");
  expect("-o motion.fbx", 2, "option --out: 'motion.fbx' does not end with .glb.");
  expect("-o missing/../motion.glb --trace creature --duration 0.1", 1, "creature: ");
  EXPECT_EQ(motion_bytes(creature_), motion);

  const std::string body = io::read_file(creature_ / "body.json");
  const auto expect_of_body = [&](const std::string& broken, const std::string& told) {
    std::ofstream(creature_ / "body.json") << broken;
    const Outcome outcome = replay("--duration 0.1");
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.err.find("body.json: " + told), std::string::npos) << outcome.err;
  };
  expect_of_body("not JSON", "");
  nlohmann::json json = nlohmann::json::parse(body);
  const auto changed = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json copy = json;
    copy[key] = value;
    return copy.dump();
  };
  expect_of_body(changed("schema", "hydrostat.body/9"), "'schema': ");
  expect_of_body(changed("mass_kg", {1, 2}), "'mass_kg': has 2 entries where ");
  expect_of_body(changed("tets", {{0, 1, 2, 100000}}), "'tets': points at something that does not exist.");
  expect_of_body(changed("tets", {{0, 1, 2}}), "'tets', entry 0: has not 4 numbers.");
  expect_of_body(changed("edges", {{0, 1}}), "");
  expect_of_body(changed("length_m", -1), "'length_m': is no number above 0.");
  std::ofstream(creature_ / "body.json") << body;

  std::ofstream(creature_ / "signals.json") << "{}";
  expect("--duration 0.1", 1, "signals.json: ");
  fs::remove(creature_ / "target.bin");
  expect("--duration 0.1", 1, "target.bin: ");
  fs::remove(creature_ / "creature.toml");
  expect("--duration 0.1", 1, "creature: is no creature. Make one with 'hydrostat convert'.");
}

}  // namespace
}  // namespace hydrostat::replay_test

#include <gtest/gtest.h>

#include <sstream>

#include "tests/e2e/made_creature.h"

namespace hydrostat::convert_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kMomentum = 1e-6;  // [mg]

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

/// On a mesh where the planned body gains by it and one off the plan falls. Nothing else is changed.
TEST(Convert, LeavesOutPolishThatCostsOtherBodiesTheirBalance) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  const std::string options = "--nodes 40 ";
  convert(directory.path, kSmallClip, "creature", options);
  const json before = report_of(creature);
  const std::string motion = motion_bytes(creature), signals = io::read_file(creature / "signals.json");
  ASSERT_EQ(convert(directory.path, kSmallClip, "creature", options + "--polish on").exit_code, 0);
  const json after = report_of(creature);
  EXPECT_FALSE(after.contains("polish"));
  EXPECT_FALSE(fs::exists(creature / "path.bin"));
  EXPECT_EQ(io::read_file(creature / "signals.json"), signals);
  EXPECT_EQ(motion_bytes(creature), motion);
  EXPECT_EQ(after["replay"]["closed_loop"]["correction_rms"], before["replay"]["closed_loop"]["correction_rms"]);
  const auto is_told = [](const json& warning) { return warning.get<std::string>().find("polish: left out") != std::string::npos; };
  EXPECT_TRUE(std::any_of(after["warnings"].begin(), after["warnings"].end(), is_told)) << after["warnings"];
}

/// What of the correction comes back in every cycle is the signals' own then, and they keep the creature up by themselves for longer.
TEST(Convert, PolishesTheSignals) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  const std::string options = "--nodes 50 ";  // by which its open loop falls
  convert(directory.path, kSmallClip, "creature", options);
  const json before = report_of(creature)["replay"];
  EXPECT_FALSE(report_of(creature).contains("polish"));
  ASSERT_EQ(convert(directory.path, kSmallClip, "creature", options + "--polish on").exit_code, 0);
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

  convert(directory.path, kSmallClip, "creature", options + "--limit 0.3");
  const std::set<std::string> limited = names_in(cache);
  EXPECT_EQ(stages_kept(first, limited), (Stages{"body", "coupling", "preparation"}));

  convert(directory.path, kSmallClip, "creature", options + "--limit 0.3 --seed 3");
  const std::set<std::string> seeded = names_in(cache);
  EXPECT_EQ(stages_kept(limited, seeded), (Stages{"body", "coupling", "preparation", "inverse_dynamics", "wobble"}));

  convert(directory.path, kSmallClip, "creature", options + "--limit 0.3 --friction 0.7");
  EXPECT_EQ(stages_kept(seeded, names_in(cache)), (Stages{"body", "coupling"}));

  convert(directory.path, kSmallClip, "afresh", options + "--limit 0.3 --friction 0.7");
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
  const std::string cause = run["fall_cause"], warnings = report_of(creature)["warnings"].dump();
  for (const char* word : {"frame ", "limb '", "limit"}) EXPECT_NE(cause.find(word), std::string::npos) << cause;
  for (const char* word : {"rises by", "give --height 0."}) EXPECT_NE(warnings.find(word), std::string::npos) << "the mend; " << warnings;
}

TEST(Convert, KeepsTheLayersOfASignalFile) {
  const TemporaryDirectory directory;
  convert(directory.path, kSmallClip, "creature", kSmallOptions);
  hydrostat_in(directory.path, "signals creature gain --bone 'head*' --factor 0.5 --name softer");
  convert(directory.path, kSmallClip, "creature", std::string(kSmallOptions) + "--limit 0.3");
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
    convert(directory.path, kSmallClip, "creature", kSmallOptions + std::string("--limit 0.3 ") + options);
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
    convert(directory.path, kSmallClip, "creature", kSmallOptions + std::string("--limit 0.3 --seed 3 ") + options);
    const json again = report_of(creature);
    EXPECT_EQ(again["body"], report["body"]);
  }
}

/// A dog of fifteen centimetres, whose leap as it is drawn no feedback lands.
TEST(Convert, SpreadsTheLoadOfWhatWouldFallAndRemembersIt) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  ASSERT_EQ(convert(directory.path, "boxdog_jump.glb", "creature", std::string(kSmallOptions) + "--height 0.15").exit_code, 0);
  const json report = report_of(creature);
  EXPECT_FALSE(report["replay"]["closed_loop"]["fell"]);
  EXPECT_NE(report["warnings"].dump().find("spreads its load"), std::string::npos) << report["warnings"];
  EXPECT_NE(io::read_file(creature / "creature.toml").find("load = 'spread'"), std::string::npos);
  const std::string motion = motion_bytes(creature);
  EXPECT_EQ(hydrostat_in(directory.path, "replay creature --quiet").exit_code, 0);
  EXPECT_EQ(motion_bytes(creature), motion);
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

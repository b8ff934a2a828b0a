#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/e2e/made_creature.h"
#include "tests/e2e/trace_audit.h"

namespace hydrostat::simulate_test {
namespace {

namespace fs = std::filesystem;

fs::path scene_of(const std::string& name) { return fs::path(HYDROSTAT_SAMPLES) / "scenes" / (name + ".toml"); }

Outcome simulate(const fs::path& directory, const fs::path& scene, const std::string& options = "") {
  return hydrostat_in(directory, "simulate " + in_quotes(scene) + " -o out --quiet " + options);
}

/// What every trace must hold, whatever happens in it.
void expect_sound(const TraceAudit& audit) {
  EXPECT_LT(audit.momentum_mg, 1e-6);
  EXPECT_LT(audit.angular_mgl, 0.02);  // gravity's moment is taken at the row's middle here
  EXPECT_LT(audit.moment_mgl, 0.02);
  EXPECT_LT(audit.com_path_miss, 1);
  EXPECT_EQ(audit.correction_ns, 0);
}

/// The COM's place along `axis` over the rows.
std::vector<double> com_along(const fs::path& trace, const Eigen::Vector3d& axis) {
  const auto mass = io::read_npy_double(trace / "mass.npy"), position = io::read_npy_double(trace / "position.npy");
  const Eigen::Map<const Eigen::VectorXd> m(mass.values.data(), static_cast<Eigen::Index>(mass.values.size()));
  std::vector<double> places;
  for (std::size_t s = 0; s < position.shape[0]; ++s) places.push_back(axis.dot(audit::points(position, s) * m / m.sum()));
  return places;
}

TEST(Simulate, BlockSlidesDownASlopeAsFrictionLetsIt) {
  const TemporaryDirectory directory;
  const Outcome outcome = simulate(directory.path, scene_of("block_on_slope"), "--trace trace");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("out: 2 s of"), std::string::npos) << outcome.out;
  expect_sound(audit_trace(directory.path / "trace", directory.path / "out"));
  const double angle = 20 * std::numbers::pi / 180;
  const std::vector<double> place = com_along(directory.path / "trace", {-std::cos(angle), -std::sin(angle), 0});
  // From the mean speeds of the second half's two halves.
  const std::size_t rows = place.size() - 1, half = rows / 2, quarter = rows / 4;
  const double seconds = static_cast<double>(quarter) / 240;
  const double acceleration = (place[half + 2 * quarter] - 2 * place[half + quarter] + place[half]) / (seconds * seconds);
  const double expected = 9.81 * (std::sin(angle) - 0.3 * std::cos(angle));
  EXPECT_NEAR(acceleration / expected, 1, 0.02);
}

TEST(Simulate, BlockStaysWhereFrictionHoldsIt) {
  const TemporaryDirectory directory;
  std::string text = io::read_file(scene_of("block_on_slope"));
  text.replace(text.find("friction = 0.3"), 14, "friction = 0.5");
  io::write_file(directory.path / "scene.toml", text);
  for (const std::string method : {"explicit", "euler"}) {
    SCOPED_TRACE(method);
    ASSERT_EQ(simulate(directory.path, "scene.toml", "--trace trace --method " + method).exit_code, 0);
    const double angle = 20 * std::numbers::pi / 180;
    const std::vector<double> place = com_along(directory.path / "trace", {-std::cos(angle), -std::sin(angle), 0});
    EXPECT_LT(std::abs(place.back() - place[place.size() / 2]), 0.0005);  // [m] in the second second
  }
}

TEST(Simulate, DiscOfThePlaneFallsFreelyAndBounces) {
  const TemporaryDirectory directory;
  const Outcome outcome = simulate(directory.path, scene_of("bouncing_circle"), "--trace trace --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const TraceAudit audit = audit_trace(directory.path / "trace", directory.path / "out");
  expect_sound(audit);
  EXPECT_LT(audit.cone_excess_mg, 1e-9);
  EXPECT_LT(audit.pull_mg, 1e-9);
  const auto position = io::read_npy_double(directory.path / "trace" / "position.npy");
  for (std::size_t k = 2; k < position.values.size(); k += 3) ASSERT_EQ(position.values[k], 0);
  EXPECT_EQ(io::read_npy_int(directory.path / "trace" / "elements.npy").shape.at(1), 3U);
  // Its lowest point starts 1 m above the ground: it falls for 0.45 s.
  const std::vector<double> height = com_along(directory.path / "trace", Eigen::Vector3d::UnitY());
  EXPECT_NEAR(height[96], 1.2 - 0.5 * 9.81 * 0.4 * 0.4, 0.005);
  EXPECT_LT(*std::min_element(height.begin(), height.end()), 0.2);
  EXPECT_NEAR(height.back(), 0.2, 0.02);

  const nlohmann::json report = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(report.at("schema"), "hydrostat.report/1");
  EXPECT_EQ(report.at("simulation").at("dimension"), 2);
  EXPECT_EQ(report.at("simulation").at("inverted_elements"), 0);
  EXPECT_LT(report.at("simulation").at("energy_excess_mgl"), 0.01);
  EXPECT_FALSE(report.contains("replay"));
  EXPECT_EQ(report.at("effects").size(), 13U);
  EXPECT_EQ(names_in(directory.path / "out"),
            (std::set<std::string>{"creature.toml", "body.json", "replay.glb", "report.json", "report.html"}));
}

TEST(Simulate, ClampedBarSagsAsBeamsOfItsMaterialDo) {
  const TemporaryDirectory directory;
  ASSERT_EQ(simulate(directory.path, scene_of("clamped_bar"), "--trace trace").exit_code, 0);
  expect_sound(audit_trace(directory.path / "trace", directory.path / "out"));
  const auto position = io::read_npy_double(directory.path / "trace" / "position.npy");
  const std::size_t settled = 470;  // at 1.96 s
  const Eigen::Matrix3Xd start = audit::points(position, 0), end = audit::points(position, settled);
  Eigen::Index tip = 0;
  for (Eigen::Index n = 0; n < start.cols(); ++n) {
    if ((start.col(n) - Eigen::Vector3d(0.5, 1, 0)).norm() < 1e-9) tip = n;
  }
  ASSERT_NEAR(start(0, tip), 0.5, 1e-9);
  // 4.8 mm is where ever finer meshes of CalculiX 2.20 lead.
  EXPECT_NEAR((start(1, tip) - end(1, tip)) / 4.8e-3, 1, 0.05);
  const std::vector<double> height = com_along(directory.path / "trace", Eigen::Vector3d::UnitY());
  EXPECT_NEAR(height[480] - height[552], 0.5 * 9.81 * 0.3 * 0.3, 0.01);
}

TEST(Simulate, GivesTheSameBytesAgainAndReplacesWhatStoodThere) {
  const TemporaryDirectory directory;
  const std::string options = "--duration 0.5 --threads ";
  ASSERT_EQ(simulate(directory.path, scene_of("concave_outline"), options + "1").exit_code, 0);
  const std::string first = io::read_file(directory.path / "out" / "replay.glb"), body = io::read_file(directory.path / "out" / "body.json");
  io::write_file(directory.path / "out" / "notes.txt", "mine");
  ASSERT_EQ(simulate(directory.path, scene_of("concave_outline"), options + "2").exit_code, 0);
  EXPECT_EQ(io::read_file(directory.path / "out" / "replay.glb"), first);
  EXPECT_EQ(io::read_file(directory.path / "out" / "body.json"), body);
  EXPECT_EQ(io::read_file(directory.path / "out" / "notes.txt"), "mine");
}

TEST(Simulate, SwingingBarTearsAndItsLowerPartComesToLie) {
  const TemporaryDirectory directory;
  const Outcome outcome = simulate(directory.path, scene_of("tearing_bar"), "--json --trace trace");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_sound(audit_trace(directory.path / "trace", directory.path / "out"));
  const nlohmann::json report = nlohmann::json::parse(outcome.out), &run = report.at("simulation");
  ASSERT_FALSE(run.at("fractures").empty());
  EXPECT_GT(run.at("fractures").front().at("time_s"), 0.3);  // not before the push
  EXPECT_EQ(run.at("pieces_end"), 2);
  EXPECT_EQ(run.at("inverted_elements_end"), 0);
  EXPECT_LT(run.at("energy_excess_mgl"), 1e-3);
  const auto position = io::read_npy_double(directory.path / "trace" / "position.npy");
  EXPECT_EQ(position.shape.at(1), report.at("body").at("nodes"));
  EXPECT_LT(audit::points(position, position.shape.at(0) - 1).row(1).minCoeff(), 0.01);  // it lies on the ground
}

/// A flattened square that spins: backward Euler brings it back into shape, and loses angular momentum by it.
TEST(Simulate, WarnsOfABodyThatTheGuardTurnedInTheAir) {
  const TemporaryDirectory directory;
  io::write_file(directory.path / "scene.toml",
                 "dimension = 2\nduration_s = 0.3\ngravity_m_s2 = [0.0, 0.0]\n[body]\nshape = \"square\"\nsize_m = 0.4\nnodes = 30\n"
                 "start = \"flattened\"\nspin_deg_s = 3000.0\n[material]\nyoungs_modulus_pa = 2e4\n");
  const Outcome outcome = simulate(directory.path, "scene.toml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("; assisted from outside by up to "), std::string::npos) << outcome.out;
  const nlohmann::json report = report_of(directory.path / "out");
  EXPECT_GT(report.at("simulation").at("external_assist_mg"), 0.01);
  EXPECT_NE(report.at("warnings").dump().find("assist: the body is not moved by its scene alone"), std::string::npos) << report.at("warnings");
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(hydrostat_in(directory.path, "simulate scene.toml -o out").err.find("\nwarning: assist: "), std::string::npos);
  ASSERT_EQ(simulate(directory.path, scene_of("random_start"), "--duration 0.2").exit_code, 0);  // by rounding alone
  EXPECT_EQ(report_of(directory.path / "out").at("warnings").dump().find("assist: "), std::string::npos);
}

TEST(Simulate, BallRecoversFromRandomPlaces) {
  const TemporaryDirectory directory;
  for (const std::string seed : {"1", "2"}) {
    const Outcome outcome = simulate(directory.path, scene_of("random_start"), "--json --seed " + seed);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json run = nlohmann::json::parse(outcome.out).at("simulation");
    EXPECT_GT(run.at("inverted_elements"), 0);
    EXPECT_EQ(run.at("inverted_elements_end"), 0);
    EXPECT_LT(run.at("volume_error_end"), 0.02);
    EXPECT_EQ(run.at("energy_excess_mgl"), 0);
  }
}

TEST(Simulate, ThatDivergesLeavesTheReportAndExitCode3) {
  const TemporaryDirectory directory;
  // No number holds the square of this speed.
  io::write_file(directory.path / "scene.toml", "[body]\nshape = \"cube\"\nsize_m = 1\nnodes = 8\nvelocity_m_s = [1e200, 0, 0]\n");
  const Outcome outcome = simulate(directory.path, "scene.toml");
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err.find("simulation: it diverged: at "), std::string::npos) << outcome.err;
  EXPECT_TRUE(fs::exists(directory.path / "out" / "failed.glb"));
  EXPECT_FALSE(fs::exists(directory.path / "out" / "replay.glb"));
  EXPECT_EQ(report_of(directory.path / "out").at("simulation").at("diverged"), true);
  EXPECT_EQ(report_of(directory.path / "out").at("outcome_ok"), false);
}

TEST(Simulate, RefusesOnOneLineAndLeavesNothing) {
  const TemporaryDirectory directory;
  io::write_file(directory.path / "bad.toml", "[body]\nshape = \"cube\"\nsize_m = -1\n");
  const Outcome outcome = simulate(directory.path, "bad.toml");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "bad.toml: line 3: 'size_m' of [body] is -1. Give a number that is at least 1e-06 and at most 1e+06.\n");
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(names_in(directory.path), std::set<std::string>{"bad.toml"});

  const Outcome rate = simulate(directory.path, scene_of("bouncing_circle"), "--trace trace --trace-rate 7");
  EXPECT_EQ(rate.exit_code, 2);
  EXPECT_NE(rate.err.find("option --trace-rate: 7 Hz is not a whole part of the 240 Hz"), std::string::npos) << rate.err;
  EXPECT_EQ(simulate(directory.path, scene_of("bouncing_circle"), "--method magic").exit_code, 2);
  const Outcome same = simulate(directory.path, scene_of("bouncing_circle"), "--trace ./out/");
  EXPECT_EQ(same.exit_code, 2);
  EXPECT_NE(same.err.find("'./out/' is where the outcome goes"), std::string::npos) << same.err;
  EXPECT_EQ(names_in(directory.path), std::set<std::string>{"bad.toml"});
}

TEST(Simulate, MayLeaveItsTraceInItsOutcome) {
  const TemporaryDirectory directory;
  ASSERT_EQ(simulate(directory.path, scene_of("block_on_slope"), "--duration 0.1 --trace out/trace").exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(directory.path / "out" / "trace" / "time.npy"));
}

TEST(Simulate, WritesNoCreatureThatCouldBeReplayed) {
  const TemporaryDirectory directory;
  ASSERT_EQ(simulate(directory.path, scene_of("block_on_slope"), "--duration 0.1").exit_code, 0);
  const Outcome outcome = hydrostat_in(directory.path, "replay out");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("holds a scene's simulation, not a creature"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace hydrostat::simulate_test

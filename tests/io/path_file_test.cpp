#include "io/path_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "retarget/error.h"

namespace hydrostat::io::path_file_test {
namespace {

retarget::Motion offset(Eigen::Index nodes) {
  retarget::Motion made;
  made.loop = true;
  made.rate_hz = 120 / 1.01;
  made.yaw = -0.1;
  made.frames = 1e-3 * Eigen::MatrixXd::Random(3 * nodes, 5);
  return made;
}

/// A target of two nodes that was polished.
PerformedTarget target() {
  PerformedTarget made;
  made.performer.prepared.target = offset(2);
  made.performer.path = {offset(2), offset(2)};
  made.report.polish = retarget::PolishReport{7, 0.01, 0.001, 1.5, 9};
  return made;
}

TEST(PathFile, GivesThePathBackToTheBit) {
  const PerformedTarget made = target();
  PerformedTarget back = made;
  back.performer.path = {};
  back.report.polish.reset();
  parse_path(path_bytes(made), "path.bin", back);
  EXPECT_EQ(back.performer.path.place.frames, made.performer.path.place.frames);
  EXPECT_EQ(back.performer.path.velocity.frames, made.performer.path.velocity.frames);
  EXPECT_EQ(back.performer.path.place.rate_hz, made.performer.path.place.rate_hz);
  EXPECT_EQ(back.performer.path.velocity.yaw, made.performer.path.velocity.yaw);
  EXPECT_TRUE(back.performer.path.place.loop);
  ASSERT_TRUE(back.report.polish);
  EXPECT_EQ(back.report.polish->rounds, 7);
  EXPECT_EQ(back.report.polish->correction_rms_after, 0.001);
  EXPECT_EQ(back.report.polish->open_loop_s_after, 9);
}

TEST(PathFile, KeepsWhatPolishLearnedForTheCache) {
  retarget::Polished made;
  made.path = target().performer.path;
  made.report = *target().report.polish;
  made.signals.activation.cosine = Eigen::MatrixXd::Random(3, 4);
  made.signals.activation.sine = Eigen::MatrixXd::Random(3, 4);
  made.signals.activation.cubic = Eigen::MatrixXd(0, 4);
  made.signals.force = made.signals.activation;
  made.solved_on_trials = {4, 1, 0.01};
  made.polished_on_trials = {4, 3, 0.02};
  made.is_frail = true;
  const auto back = result_of<retarget::Polished>(record_of(made));
  EXPECT_EQ(back.signals.activation.cosine, made.signals.activation.cosine);
  EXPECT_EQ(back.signals.force.sine, made.signals.force.sine);
  EXPECT_EQ(back.path.place.frames, made.path.place.frames);
  EXPECT_TRUE(back.is_better());
  EXPECT_EQ(back.solved_on_trials.bodies, 4);
  EXPECT_EQ(back.solved_on_trials.lost, 1);
  EXPECT_EQ(back.polished_on_trials.shape_rms_length, 0.02);
  EXPECT_TRUE(back.is_frail);
}

TEST(PathFile, RefusesWhatIsDamagedOrAboutAnotherBody) {
  PerformedTarget made = target();
  const std::string bytes = path_bytes(made);
  std::string spoiled = bytes;
  spoiled[spoiled.size() / 2] ^= 1;
  EXPECT_THROW(parse_path(spoiled, "path.bin", made), Error);
  EXPECT_THROW(parse_path(bytes.substr(0, bytes.size() - 9), "path.bin", made), Error);
  PerformedTarget other = target();
  other.performer.prepared.target = offset(3);
  EXPECT_THROW(parse_path(bytes, "path.bin", other), Error);
  made.performer.path.place.frames(2) = std::nan("");
  EXPECT_THROW(parse_path(path_bytes(made), "path.bin", other = target()), Error);
}

}  // namespace
}  // namespace hydrostat::io::path_file_test

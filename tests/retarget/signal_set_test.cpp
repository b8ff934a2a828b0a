#include "retarget/signal_set.h"

#include <gtest/gtest.h>

#include "tests/signal/random_samples.h"

namespace hydrostat::retarget::signal_set_test {
namespace {

using signal::Gain;
using signal::Kind;
using signal::smooth_loop;

constexpr int kFrames = 48;

/// Four edges of two bones.
SolvedSignals solved_signals(unsigned seed, Kind kind = Kind::loop) {
  SolvedSignals solved;
  solved.kind = kind;
  solved.period_s = 0.8;
  solved.limit = 0.3;
  solved.activation = smooth_loop(seed, kFrames, 4);
  solved.bones = {"thigh", "thigh", "spine", "spine"};
  solved.nodes.resize(2, 4);
  solved.nodes << 0, 0, 1, 2, 1, 2, 2, 3;
  solved.rest_length = Eigen::Vector4d(0.1, 0.2, 0.3, 0.4);
  solved.stiffness = Eigen::Vector4d(100, 200, 300, 400);
  const Eigen::MatrixXd lengths = Eigen::MatrixXd::Ones(kFrames, 4) * solved.rest_length.asDiagonal();
  solved.force = penalty_forces(solved.activation, lengths, solved.rest_length, solved.stiffness);
  return solved;
}

TEST(PenaltyForces, PullTheEndsTogetherWhereTheRestLengthIsShorter) {
  const Eigen::MatrixXd force = penalty_forces(Eigen::RowVector2d(0.9, 1.0), Eigen::RowVector2d(0.2, 0.5),
                                               Eigen::Vector2d(0.2, 0.4), Eigen::Vector2d(1000, 10));
  EXPECT_NEAR(force(0, 0), 1000 * (0.2 - 0.9 * 0.2), 1e-12);
  EXPECT_NEAR(force(0, 1), 10 * (0.5 - 0.4), 1e-12);
}

TEST(AnalyseSignals, MeetsTheTargetError) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const Kind kind : {Kind::loop, Kind::one_shot}) {
      const SolvedSignals solved = solved_signals(seed, kind);
      const SignalSet set = analyse_signals(solved, {.target_rms = 0.002});
      EXPECT_LE(activation_error_rms(set, solved.activation), 0.002);
      EXPECT_EQ(set.channels[2].name, "edge/1-2");
      EXPECT_EQ(set.channels[2].group, "spine");
      EXPECT_NEAR(set.rate_hz(), (kind == Kind::loop ? kFrames : kFrames - 1) / 0.8, 1e-12);
    }
  }
}

TEST(AnalyseSignals, ForcesComeBackWithTheActivations) {
  const SolvedSignals solved = solved_signals(1);
  const SignalSet set = analyse_signals(solved, {.harmonics = kFrames / 2});
  EXPECT_LT((signal::synthesise_samples(set.force, kFrames) - solved.force).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Activations, AreTheSolvedOnesWithTheirLayersWithinTheLimit) {
  SignalSet set = analyse_signals(solved_signals(1), {.target_rms = 1e-6});
  set.layers.push_back({"strong", {.group = "thigh"}, Gain{4}});
  const EditedActivations edited = edited_activations(set);
  EXPECT_GT(edited.clipped, 0);
  EXPECT_EQ(edited.solved_clipped, 0);
  EXPECT_EQ(edited.touched, std::vector{2});
  signal::Synthesiser player = activations(set);
  Eigen::VectorXd activation(4);
  Eigen::Index clipped = 0;
  for (int j = 0; j < kFrames; ++j) {
    clipped += player.at(j / set.rate_hz(), activation);
    EXPECT_LT((activation.transpose() - edited.samples.row(j)).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_GE(activation.minCoeff(), 0.7);
    EXPECT_LE(activation.maxCoeff(), 1.3);
  }
  EXPECT_EQ(clipped, edited.clipped);
}

TEST(KeepLayers, AReSolveKeepsThem) {
  SignalSet earlier = analyse_signals(solved_signals(1), {});
  earlier.layers.push_back({"strong", {.group = "thigh"}, Gain{0.5}});
  SignalSet set = analyse_signals(solved_signals(2), {});
  const signal::Spectrum solved = set.activation;
  EXPECT_TRUE(keep_layers(earlier, set).empty());
  EXPECT_EQ(set.activation.cosine, solved.cosine);
  const Eigen::MatrixXd before = signal::synthesise_samples(solved, kFrames);
  const Eigen::MatrixXd after = edited_activations(set).samples;
  EXPECT_LT((after.leftCols(2).array() - (1 + 0.5 * (before.leftCols(2).array() - 1))).abs().maxCoeff(), 1e-13);
  EXPECT_LT((after.rightCols(2) - before.rightCols(2)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(KeepLayers, TellsWhatCannotBeKept) {
  SignalSet earlier = analyse_signals(solved_signals(1), {});
  earlier.layers.push_back({"peaked", {}, signal::SetHarmonic{2, 0.1, 0.5}});
  earlier.layers.push_back({"tail", {.group = "tail"}, Gain{0.5}});
  SignalSet set = analyse_signals(solved_signals(2, Kind::one_shot), {});
  const std::vector<std::string> told = keep_layers(earlier, set);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_NE(told[0].find("'peaked' was left out"), std::string::npos);
  EXPECT_NE(told[1].find("'tail' no longer touches"), std::string::npos);
  ASSERT_EQ(set.layers.size(), 1u);
  EXPECT_EQ(set.layers[0].name, "tail");
}

TEST(SignalsByBone, SumUpTheirChannels) {
  SignalSet set = analyse_signals(solved_signals(3), {.target_rms = 1e-6});
  const EditedActivations edited = edited_activations(set);
  const std::vector<BoneSignals> bones = signals_by_bone(set, edited, {0, 1, 2, 3});
  ASSERT_EQ(bones.size(), 2u);
  EXPECT_EQ(bones[0].bone, "thigh");
  EXPECT_EQ(bones[1].channels, (std::vector{2, 3}));
  EXPECT_NEAR(bones[0].mean, set.activation.cosine.row(0).head<2>().mean(), 1e-12);
  const Eigen::MatrixXd harmonics = set.activation.cosine.bottomRows(set.activation.harmonics());
  const Eigen::MatrixXd sines = set.activation.sine.bottomRows(set.activation.harmonics());
  const double energy = 0.5 * (harmonics.leftCols(2).squaredNorm() + sines.leftCols(2).squaredNorm()) / 2;
  EXPECT_NEAR(bones[0].rms * bones[0].rms, energy, 1e-9);  // Parseval
  ASSERT_EQ(bones[0].strongest.size(), 3u);
  EXPECT_EQ(bones[0].strongest[0].harmonic, 1);
  EXPECT_GE(bones[0].strongest[0].amplitude, bones[0].strongest[1].amplitude);
}

TEST(BrokenRule, NamesTheSignalOptionThatIsWrong) {
  EXPECT_EQ(broken_rule(SignalOptions{}, Kind::loop, 10), "");
  EXPECT_NE(broken_rule(SignalOptions{}, Kind::one_shot, 3), "");
  EXPECT_NE(broken_rule({.target_rms = -1}, Kind::loop, 10).find("target"), std::string::npos);
  EXPECT_NE(broken_rule({.harmonics = 6}, Kind::loop, 10).find("harmonics"), std::string::npos);
  EXPECT_NE(broken_rule({.roll_off = -1}, Kind::loop, 10).find("roll-off"), std::string::npos);
}

}  // namespace
}  // namespace hydrostat::retarget::signal_set_test

#include "signal/layers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/signal/random_samples.h"

namespace hydrostat::signal::layers_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Kind kKinds[] = {Kind::loop, Kind::one_shot};

const std::vector<Label> kLabels{{"edge/0-1", "FL_upper"}, {"edge/0-2", "FL_lower"}, {"edge/1-2", "spine"}};

Layer layer(const std::variant<SetHarmonic, Gain, Shift, Filter>& edit, const Selection& selection = {}) {
  return {"test", selection, edit};
}

Spectrum edited(const Layer& layer, const Spectrum& solved) { return apply({layer}, solved, kLabels, 1).spectrum; }

double distance(const Spectrum& a, const Spectrum& b) {
  return (synthesise_samples(a, a.samples) - synthesise_samples(b, a.samples)).cwiseAbs().maxCoeff();
}

TEST(SelectedChannels, MatchByNameAndByGroup) {
  EXPECT_EQ(selected_channels({}, kLabels), (std::vector{0, 1, 2}));
  EXPECT_EQ(selected_channels({.group = "FL_*"}, kLabels), (std::vector{0, 1}));
  EXPECT_EQ(selected_channels({.channel = "edge/?-2"}, kLabels), (std::vector{1, 2}));
  EXPECT_EQ(selected_channels({.channel = "edge/?-2", .group = "FL_*"}, kLabels), (std::vector{1}));
  EXPECT_TRUE(selected_channels({.group = "tail"}, kLabels).empty());
}

TEST(BrokenRule, OfLayersTogetherNamesTheFirstThatIsTooMuch) {
  for (const Kind kind : kKinds) {
    const Spectrum solved = analyse(kind, random_samples(1, 30, 3), 8);
    const auto gain = [](const std::string& name, double factor) { return Layer{name, {}, Gain{factor}}; };
    EXPECT_EQ(broken_rule({gain("one", 1e80)}, solved, kLabels, 1), "");
    EXPECT_EQ(broken_rule({gain("one", 1e80), gain("two", 1e80), gain("three", 2)}, solved, kLabels, 1),
              "layer 'two' makes the signals too large to be reckoned with");
    EXPECT_EQ(broken_rule({gain("one", 1e308)}, solved, kLabels, 1), "layer 'one' makes the signals too large to be reckoned with");
  }
}

TEST(Apply, WithoutLayersChangesNothing) {
  for (const Kind kind : kKinds) {
    const Spectrum solved = analyse(kind, random_samples(1, 30, 3), 8);
    const Edited result = apply({}, solved, kLabels, 1);
    EXPECT_EQ(result.spectrum.cosine, solved.cosine);
    EXPECT_TRUE(result.touched.empty());
  }
}

TEST(Apply, NeutralEditsChangeNothing) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const Kind kind : kKinds) {
      const Spectrum solved = analyse(kind, random_samples(seed, 30, 3), 8);
      EXPECT_LT(distance(edited(layer(Gain{1}), solved), solved), 1e-12);
      EXPECT_LT(distance(edited(layer(Shift{0}), solved), solved), 1e-12);
      EXPECT_LT(distance(edited(layer(Filter{}), solved), solved), 1e-12);
      EXPECT_LT(distance(edited(layer(Gain{1}, {.range = PhaseRange{0.2, 0.6}}), solved), solved), 1e-12);
    }
  }
}

TEST(Apply, TouchesOnlyTheChannelsAndTheBandSelected) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const Kind kind : kKinds) {
      const Spectrum solved = analyse(kind, random_samples(seed, 30, 3), 8);
      const Edited result = apply({layer(Gain{3}, {.group = "FL_*", .band = Band{2, 4}})}, solved, kLabels, 1);
      EXPECT_EQ(result.touched, std::vector{2});
      for (int c = 0; c < 3; ++c) {
        for (int k = 0; k <= 8; ++k) {
          const double factor = c < 2 && k >= 2 && k <= 4 ? 3 : 1;
          EXPECT_EQ(result.spectrum.cosine(k, c), factor * solved.cosine(k, c));
          if (kind == Kind::loop) {
            EXPECT_EQ(result.spectrum.sine(k, c), factor * solved.sine(k, c));
          }
        }
      }
      EXPECT_EQ(result.spectrum.cubic, solved.cubic);
    }
  }
}

TEST(Gain, ScalesTheDeviationFromRest) {
  for (const Kind kind : kKinds) {
    const Spectrum solved = analyse(kind, random_samples(7, 30, 3), 8);
    const Eigen::MatrixXd before = synthesise_samples(solved, 30);
    const Eigen::MatrixXd after = synthesise_samples(edited(layer(Gain{0.5}), solved), 30);
    EXPECT_LT((after.array() - (1 + 0.5 * (before.array() - 1))).abs().maxCoeff(), 1e-13);
  }
}

TEST(Gain, InARangeIsHeardThereAlone) {
  const int n = 100;
  for (const Kind kind : kKinds) {
    const Spectrum solved = analyse(kind, smooth_loop(7, n, 3), 5);
    const Eigen::MatrixXd before = synthesise_samples(solved, n);
    const Eigen::MatrixXd after = synthesise_samples(edited(layer(Gain{2}, {.range = PhaseRange{0.25, 0.5}}), solved), n);
    EXPECT_LT((after - before).topRows(24).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((after - before).bottomRows(49).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((after.row(37).array() - (1 + 2 * (before.row(37).array() - 1))).abs().maxCoeff(), 1e-12);
  }
}

TEST(Gain, RangeOfALoopMayRunOverItsEnd) {
  const int n = 100;
  const Spectrum solved = analyse_loop(smooth_loop(7, n, 3), 5);
  const Eigen::MatrixXd before = synthesise_samples(solved, n);
  const Eigen::MatrixXd after = synthesise_samples(edited(layer(Gain{2}, {.range = PhaseRange{0.9, 0.1}}), solved), n);
  EXPECT_LT((after - before).middleRows(10, 81).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((after.row(0).array() - (1 + 2 * (before.row(0).array() - 1))).abs().maxCoeff(), 1e-12);
}

TEST(Shift, LetsALoopComeLater) {
  const Spectrum solved = analyse_loop(random_samples(9, 40, 3), 12);
  const Spectrum later = edited(layer(Shift{0.2}), solved);
  for (const double phase : {0.0, 0.13, 0.77}) {
    EXPECT_LT((synthesise(later, phase + 0.2) - synthesise(solved, phase)).norm(), 1e-13);
  }
}

TEST(Shift, LetsAOneShotComeLaterAndHoldsItsStart) {
  const int n = 101;
  const Spectrum solved = analyse_one_shot(smooth_loop(9, n, 3), 12);
  const Eigen::MatrixXd before = synthesise_samples(solved, n);
  const Eigen::MatrixXd after = synthesise_samples(edited(layer(Shift{0.2}), solved), n);
  EXPECT_LT((after.bottomRows(81) - before.topRows(81)).cwiseAbs().maxCoeff(), 1e-12);
  for (int j = 0; j < 20; ++j) EXPECT_LT((after.row(j) - before.row(0)).norm(), 1e-12);
}

TEST(Shift, OfABandLeavesTheOthers) {
  const Spectrum solved = analyse_loop(random_samples(9, 40, 3), 12);
  const Spectrum later = edited(layer(Shift{0.2}, {.band = Band{1, 3}}), solved);
  EXPECT_EQ(later.cosine.bottomRows(9), solved.cosine.bottomRows(9));
  EXPECT_EQ(later.cosine.row(0), solved.cosine.row(0));
  EXPECT_GT((later.cosine.row(2) - solved.cosine.row(2)).norm(), 0.01);
}

TEST(SetHarmonic, GivesAmplitudeAndPhase) {
  const Spectrum solved = analyse_loop(random_samples(2, 40, 3), 6);
  const Spectrum result = edited(layer(SetHarmonic{3, 0.5, kPi / 3}), solved);
  EXPECT_LT((result.cosine.row(3).array() - 0.25).abs().maxCoeff(), 1e-15);
  EXPECT_LT((result.sine.row(3).array() - 0.5 * std::sin(kPi / 3)).abs().maxCoeff(), 1e-15);
  EXPECT_EQ(result.cosine.row(2), solved.cosine.row(2));
}

TEST(SetHarmonic, KeepsThePhaseThatIsThere) {
  const Spectrum solved = analyse_loop(random_samples(2, 40, 3), 6);
  const Spectrum result = edited(layer(SetHarmonic{3, 0.5, {}}), solved);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(std::hypot(result.cosine(3, c), result.sine(3, c)), 0.5, 1e-15);
    EXPECT_NEAR(result.cosine(3, c) * solved.sine(3, c), result.sine(3, c) * solved.cosine(3, c), 1e-15);
  }
}

TEST(SetHarmonic, ZeroIsTheMeanOfTheSamples) {
  for (const Kind kind : kKinds) {
    const Spectrum solved = analyse(kind, random_samples(2, 40, 3), 6);
    const Eigen::MatrixXd samples = synthesise_samples(edited(layer(SetHarmonic{0, 0.9, {}}), solved), 40);
    EXPECT_LT((samples.colwise().mean().array() - 0.9).abs().maxCoeff(), 1e-14);
  }
}

TEST(SetHarmonic, MayLieBeyondThoseSolved) {
  const Spectrum solved = analyse_loop(random_samples(2, 40, 3), 6);
  const Spectrum result = edited(layer(SetHarmonic{9, 0.1, 0.0}, {.channel = "edge/0-1"}), solved);
  ASSERT_EQ(result.harmonics(), 9);
  EXPECT_EQ(result.cosine.row(9), Eigen::RowVector3d(0.1, 0, 0));
  EXPECT_EQ(result.cosine.topRows(7), solved.cosine);
}

TEST(Filter, KeepsTheBandAndTheMean) {
  for (const Kind kind : kKinds) {
    const Spectrum solved = analyse(kind, random_samples(2, 40, 3), 8);
    const Spectrum result = edited(layer(Filter{}, {.band = Band{3, 5}}), solved);
    ASSERT_EQ(result.harmonics(), 8);
    for (int k = 0; k <= 8; ++k) {
      const bool kept = k == 0 || (k >= 3 && k <= 5);
      EXPECT_EQ(result.cosine.row(k), kept ? solved.cosine.row(k).eval() : Eigen::RowVectorXd::Zero(3).eval());
    }
    EXPECT_EQ(result.cubic, solved.cubic);
  }
}

TEST(Filter, RollOffFadesTheLastHarmonics) {
  const Spectrum solved = analyse_loop(random_samples(2, 40, 3), 8);
  const Spectrum result = edited(layer(Filter{1}, {.band = Band{0, 5}}), solved);
  EXPECT_EQ(result.cosine.row(4), solved.cosine.row(4));
  EXPECT_LT((result.cosine.row(5) - 0.5 * solved.cosine.row(5)).norm(), 1e-15);
}

TEST(Apply, RunsTheLayersInTheirOrder) {
  const Spectrum solved = analyse_loop(random_samples(2, 40, 3), 8);
  const Layer set = layer(SetHarmonic{2, 0.4, 0.0});
  const Layer twice = layer(Gain{2}, {.band = Band{2, 2}});
  EXPECT_NEAR(apply({set, twice}, solved, kLabels, 1).spectrum.cosine(2, 0), 0.8, 1e-15);
  EXPECT_NEAR(apply({twice, set}, solved, kLabels, 1).spectrum.cosine(2, 0), 0.4, 1e-15);
}

TEST(BrokenRule, NamesWhatIsWrong) {
  const double infinite = std::numeric_limits<double>::infinity();
  const auto rule = [](const Layer& checked, Kind kind = Kind::loop) { return broken_rule(checked, kind, 20); };
  EXPECT_EQ(rule(layer(Gain{2})), "");
  EXPECT_NE(rule(layer(Gain{infinite})).find("factor"), std::string::npos);
  EXPECT_NE(rule(layer(Shift{1.5})).find("shift"), std::string::npos);
  EXPECT_NE(rule(layer(Filter{-1})).find("roll-off"), std::string::npos);
  EXPECT_NE(rule(layer(SetHarmonic{11, 0.1, {}})).find("harmonic 11 is not in 0 to 10"), std::string::npos);
  EXPECT_EQ(rule(layer(SetHarmonic{10, 0.1, {}})), "");
  EXPECT_NE(rule(layer(SetHarmonic{1, infinite, {}})).find("amplitude"), std::string::npos);
  EXPECT_NE(rule(layer(SetHarmonic{0, 1, 0.0})).find("mean"), std::string::npos);
  EXPECT_NE(rule(layer(SetHarmonic{1, 1, 0.0}), Kind::one_shot).find("no phase"), std::string::npos);
  EXPECT_NE(rule(layer(Gain{2}, {.band = Band{3, 2}})).find("band"), std::string::npos);
  EXPECT_NE(rule(layer(Gain{2}, {.range = PhaseRange{0, 1.5}})).find("range"), std::string::npos);
  EXPECT_NE(rule(layer(Gain{2}, {.range = PhaseRange{1, 0}})).find("empty"), std::string::npos);
  EXPECT_EQ(rule(layer(Gain{2}, {.range = PhaseRange{0.9, 0.1}})), "");
  EXPECT_NE(rule(layer(Gain{2}, {.range = PhaseRange{0.9, 0.1}}), Kind::one_shot).find("forward"), std::string::npos);
}

}  // namespace
}  // namespace hydrostat::signal::layers_test

#include "signal/spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/signal/random_samples.h"

namespace hydrostat::signal::spectrum_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Kind kKinds[] = {Kind::loop, Kind::one_shot};

double phase_of(Kind kind, int sample, int n) { return static_cast<double>(sample) / (kind == Kind::loop ? n : n - 1); }

TEST(Analyse, AllHarmonicsGiveTheSamplesBack) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const int n = 4 + static_cast<int>(seed) * 7;
    const Eigen::MatrixXd samples = random_samples(seed, n, 5);
    for (const Kind kind : kKinds) {
      const Spectrum spectrum = analyse(kind, samples, max_harmonics(kind, n), /*roll_off=*/2);
      EXPECT_LT((synthesise_samples(spectrum, n) - samples).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_LT((synthesise(spectrum, phase_of(kind, n / 3, n)) - samples.row(n / 3).transpose()).cwiseAbs().maxCoeff(),
                1e-12);
    }
  }
}

TEST(AnalyseLoop, FindsTheCoefficientsThatMadeTheSignal) {
  const int n = 20;
  Eigen::VectorXd samples(n);
  for (int j = 0; j < n; ++j) {
    const double turn = 2 * kPi * j / n;
    samples[j] = 1.5 + 0.25 * std::cos(2 * turn) - 0.5 * std::sin(3 * turn);
  }
  const Spectrum spectrum = analyse_loop(samples, 4);
  EXPECT_LT((spectrum.cosine.col(0) - Eigen::Vector<double, 5>(1.5, 0, 0.25, 0, 0)).norm(), 1e-15);
  EXPECT_LT((spectrum.sine.col(0) - Eigen::Vector<double, 5>(0, 0, 0, -0.5, 0)).norm(), 1e-15);
}

TEST(AnalyseLoop, KeepsTheEnergy) {  // Parseval
  for (const int n : {15, 16}) {
    const Eigen::MatrixXd samples = random_samples(3, n, 4);
    const Spectrum spectrum = analyse_loop(samples, n / 2);
    double energy = spectrum.cosine.row(0).squaredNorm();
    for (int k = 1; k <= n / 2; ++k) {
      const double share = 2 * k == n ? 1 : 0.5;
      energy += share * (spectrum.cosine.row(k).squaredNorm() + spectrum.sine.row(k).squaredNorm());
    }
    EXPECT_NEAR(energy, samples.squaredNorm() / n, 1e-14);
  }
}

TEST(AnalyseLoop, ShiftedSamplesTurnTheCoefficients) {
  const int n = 24;
  const Eigen::MatrixXd samples = random_samples(8, n, 3);
  Eigen::MatrixXd later(n, 3);
  for (int j = 0; j < n; ++j) later.row((j + 5) % n) = samples.row(j);
  const Spectrum a = analyse_loop(samples, 11);
  const Spectrum b = analyse_loop(later, 11);
  for (int k = 0; k <= 11; ++k) {
    const double turn = 2 * kPi * k * 5 / n;
    EXPECT_LT((b.cosine.row(k) - (std::cos(turn) * a.cosine.row(k) - std::sin(turn) * a.sine.row(k))).norm(), 1e-14);
    EXPECT_LT((b.sine.row(k) - (std::sin(turn) * a.cosine.row(k) + std::cos(turn) * a.sine.row(k))).norm(), 1e-14);
  }
}

TEST(AnalyseOneShot, IsExactForACubic) {
  const int n = 12;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(n, 0, 1);
  const Eigen::VectorXd samples = 2 - t.array() + 3 * t.array().square() - 4 * t.array().cube();
  const Spectrum spectrum = analyse_one_shot(samples, 0);
  EXPECT_LT((spectrum.cubic.col(0) - Eigen::Vector4d(2, -1, 3, -4)).norm(), 1e-12);
  EXPECT_LT(spectrum.cosine.norm(), 1e-13);
}

TEST(AnalyseOneShot, FewHarmonicsKeepEndValuesAndEndSlopes) {
  const int n = 120;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(n, 0, 1);
  const Eigen::VectorXd samples = (2.5 * t.array()).sin() + (-3 * t.array()).exp();
  const Spectrum spectrum = analyse_one_shot(samples, 8);
  EXPECT_NEAR(synthesise(spectrum, 0)[0], 1, 2e-4);
  EXPECT_NEAR(synthesise(spectrum, 1)[0], samples[n - 1], 2e-4);
  EXPECT_NEAR(synthesise_slope(spectrum, 0)[0], -0.5, 0.02);  // of slopes up to 2.2
  EXPECT_NEAR(synthesise_slope(spectrum, 1)[0], 2.5 * std::cos(2.5) - 3 * std::exp(-3), 0.02);
}

TEST(Synthesise, LoopsRepeatAndOneShotsHoldTheirEnds) {
  const Eigen::MatrixXd samples = random_samples(2, 16, 3);
  const Spectrum loop = analyse_loop(samples, 6);
  EXPECT_LT((synthesise(loop, 0.3) - synthesise(loop, 7.3)).norm(), 1e-13);
  EXPECT_LT((synthesise(loop, 0.3) - synthesise(loop, -0.7)).norm(), 1e-13);
  const Spectrum one_shot = analyse_one_shot(samples, 6);
  EXPECT_EQ(synthesise(one_shot, -0.5), synthesise(one_shot, 0));
  EXPECT_EQ(synthesise(one_shot, 2), synthesise(one_shot, 1));
  EXPECT_EQ(synthesise_slope(one_shot, 1.5).norm(), 0);
}

TEST(SynthesiseSlope, AgreesWithFiniteDifferences) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Eigen::MatrixXd samples = random_samples(seed, 30, 4);
    const double phase = 0.1 + 0.8 * seed / 30.0;
    const double step = 1e-5;
    for (const Kind kind : kKinds) {
      const Spectrum spectrum = analyse(kind, samples, 10);
      const Eigen::VectorXd difference =
          (synthesise(spectrum, phase + step) - synthesise(spectrum, phase - step)) / (2 * step);
      EXPECT_LT((synthesise_slope(spectrum, phase) - difference).cwiseAbs().maxCoeff(), 1e-4);  // of values up to 60
    }
  }
}

TEST(ChooseHarmonics, MeetsTheTargetAndNoFewerWould) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const int n = 64;
    for (const Kind kind : kKinds) {
      for (const int roll_off : {0, 2}) {
        // White noise over a slow wave: the error falls slowly, so that the choice lies inside.
        const Eigen::MatrixXd samples = smooth_loop(seed, n, 6) + 0.01 * random_samples(seed, n, 6);
        const double target = 0.004;
        const int chosen = choose_harmonics(kind, samples, target, roll_off);
        const auto error = [&](int harmonics) {
          return rms_difference(synthesise_samples(analyse(kind, samples, harmonics, roll_off), n), samples);
        };
        EXPECT_LE(error(chosen), target * (1 + 1e-9));
        ASSERT_GT(chosen, 4);
        EXPECT_GT(error(chosen - 1), target);
      }
    }
  }
}

TEST(ChooseHarmonics, TakesAtLeastFourAndAtMostWhatTheSamplesTell) {
  EXPECT_EQ(choose_harmonics(Kind::loop, Eigen::MatrixXd::Ones(40, 2), 1e-3), 4);
  EXPECT_EQ(choose_harmonics(Kind::loop, random_samples(1, 6, 2), 1e-3), 3);
  EXPECT_EQ(choose_harmonics(Kind::loop, random_samples(1, 40, 2), 0), 20);
}

TEST(Truncated, SoftCutRingsLessThanAHardOne) {
  const int n = 128;
  Eigen::VectorXd square = Eigen::VectorXd::Zero(n);
  square.head(n / 2).setOnes();
  const double hard = synthesise_samples(analyse_loop(square, 12), n).maxCoeff() - 1;
  const double soft = synthesise_samples(analyse_loop(square, 12, 12), n).maxCoeff() - 1;
  EXPECT_GT(hard, 0.05);  // Gibbs
  EXPECT_LT(soft, 0.2 * hard);
}

TEST(SpreadClosureDefect, ClosesTheLoopAndTellsHowFarItWasOpen) {
  const int n = 50;
  Eigen::MatrixXd samples(n + 1, 2);
  for (int j = 0; j <= n; ++j) samples.row(j) << std::sin(2 * kPi * j / n) + 0.02 * j / n, std::cos(2 * kPi * j / n);
  const Eigen::MatrixXd before = samples;
  EXPECT_NEAR(spread_closure_defect(samples), 0.02, 1e-14);
  EXPECT_EQ(samples.row(0), samples.row(n));
  EXPECT_LT((samples - before).cwiseAbs().maxCoeff(), 0.01 + 1e-14);
  EXPECT_LT((samples.col(1) - before.col(1)).norm(), 1e-14);
  EXPECT_LT(spread_closure_defect(samples), 1e-15);
}

}  // namespace
}  // namespace hydrostat::signal::spectrum_test

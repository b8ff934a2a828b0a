#include "retarget/loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

namespace hydrostat::retarget::loop_test {
namespace {

constexpr Eigen::Index kPeriod = 30, kPoints = 8;

/// Two harmonics on random points that go along `travel` [m] and turn by `yaw` a period, with the first frame repeated at the end,
/// missed by `defect` [m] (3N).
Motion nearly_closed(unsigned seed, const Eigen::Vector3d& travel, double yaw, const Eigen::VectorXd& defect) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Motion motion;
  motion.frames.resize(3 * kPoints, kPeriod + 1);
  for (Eigen::Index r = 0; r < 3 * kPoints; ++r) {
    const double a = uniform(random), b = uniform(random), c = uniform(random);
    for (Eigen::Index f = 0; f <= kPeriod; ++f) {
      const double phase = 2 * M_PI * static_cast<double>(f) / static_cast<double>(kPeriod);
      motion.frames(r, f) = a + 0.05 * (b * std::sin(phase) + c * std::cos(2 * phase));
    }
  }
  for (Eigen::Index f = 0; f <= kPeriod; ++f) {
    const double share = static_cast<double>(f) / static_cast<double>(kPeriod);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(share * yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    motion.at(f) = ((turn * motion.at(f)).colwise() + share * travel).eval();
    motion.frames.col(f) += (share - 0.5) * defect;
  }
  return motion;
}

Eigen::VectorXd random_defect(unsigned seed, double rms) {
  std::mt19937 random(seed + 1000);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd defect = Eigen::VectorXd::NullaryExpr(3 * kPoints, [&] { return normal(random); });
  return defect * (rms * std::sqrt(static_cast<double>(kPoints)) / defect.norm());
}

TEST(CloseLoop, FindsTravelAndTurnOfAnExactLoop) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const double yaw = 0.15 * (static_cast<double>(seed) - 10);
    const Eigen::Vector3d travel(0.3, 0, -0.1 * seed);
    const Motion given = nearly_closed(seed, travel, yaw, Eigen::VectorXd::Zero(3 * kPoints));
    double defect = 1;
    const Motion loop = close_loop(given, Eigen::VectorXd::LinSpaced(kPoints, 1, 2), 1e-3, &defect);
    ASSERT_TRUE(loop.loop);
    EXPECT_EQ(loop.count(), kPeriod);
    EXPECT_LT(defect, 1e-12);
    EXPECT_NEAR(loop.yaw, yaw, 1e-12);
    EXPECT_LT((loop.travel - travel).norm(), 1e-12);
    EXPECT_LT((loop.frames - given.frames.leftCols(kPeriod)).norm(), 1e-12);
  }
}

TEST(CloseLoop, LeavesAloneWhatIsNoLoop) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Motion given = nearly_closed(seed, Eigen::Vector3d(1, 0, 0), 0.3, random_defect(seed, 0.05));
    double defect = 0;
    const Motion same = close_loop(given, Eigen::VectorXd::Ones(kPoints), 0.01, &defect);
    EXPECT_FALSE(same.loop);
    EXPECT_GT(defect, 0.01);
    EXPECT_EQ(same.frames, given.frames);
  }
}

TEST(CloseLoop, SpreadsTheDefectWithoutAKink) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const double yaw = 0.15 * (static_cast<double>(seed) - 10);
    const Eigen::VectorXd miss = random_defect(seed, 0.01);
    const Motion exact = nearly_closed(seed, Eigen::Vector3d(0.4, 0, 0.2), yaw, Eigen::VectorXd::Zero(3 * kPoints));
    const Motion given = nearly_closed(seed, Eigen::Vector3d(0.4, 0, 0.2), yaw, miss);
    const Motion loop = close_loop(given, Eigen::VectorXd::Ones(kPoints), 0.02);
    ASSERT_TRUE(loop.loop);
    // Over the seam the motion has to go on as it does within: the steps there change no more than those of the exact loop do,
    // but for the spread defect's own bend, which is below (pi / F)^2 of it.
    const Motion exact_loop = close_loop(exact, Eigen::VectorXd::Ones(kPoints), 1e-6);
    const Eigen::MatrixXd bend = (accelerations(loop) - accelerations(exact_loop)) / (60.0 * 60.0);
    EXPECT_LT(bend.colwise().norm().maxCoeff(), 0.1 * miss.norm());
    EXPECT_LT((loop.frames - given.frames.leftCols(kPeriod)).colwise().norm().maxCoeff(), 0.6 * miss.norm());
  }
}

TEST(CloseLoop, TakesAFewFramesForNoLoop) {
  Motion short_clip;
  short_clip.frames = Eigen::MatrixXd::Zero(3, 4);
  EXPECT_FALSE(close_loop(short_clip, Eigen::VectorXd::Ones(1), 1).loop);
}

/// A body of two points that leaves the ground for the middle of its 60 frames, from rest or at a run.
Motion leap(double rise, bool from_rest) {
  Motion motion;
  motion.frames = Eigen::MatrixXd::Zero(6, 60);
  for (int f = 0; f < 60; ++f) {
    const double share = f / 59.0, eased = from_rest ? share - std::sin(2 * M_PI * share) / (2 * M_PI) : share;
    const double height = rise * std::pow(std::sin(M_PI * share), 4);
    motion.frames.col(f) << eased, height, 0, eased, height + 0.2, 0;
  }
  return motion;
}

TEST(PlayedOnce, IsALeapFromRestToRest) {
  const Eigen::VectorXd mass = Eigen::VectorXd::Ones(2);
  EXPECT_TRUE(was_made_to_be_played_once(leap(0.3, true), mass, 0.05));
  EXPECT_FALSE(was_made_to_be_played_once(leap(0.3, false), mass, 0.05)) << "it runs on";
  EXPECT_FALSE(was_made_to_be_played_once(leap(0.02, true), mass, 0.05)) << "it never leaves the ground";
  EXPECT_FALSE(was_made_to_be_played_once(leap(0, false), mass, 0.05));
}

}  // namespace
}  // namespace hydrostat::retarget::loop_test

#include "retarget/root_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

namespace hydrostat::retarget::root_motion_test {
namespace {

constexpr Eigen::Index kFrames = 48;
constexpr double kPeriod = kFrames / 60.0;  // [s]

/// Four feet below a trunk, diagonals together, each 60 % of the period on the ground. The feet of a body that goes along `travel`
/// [m] a period stand still in the world; on a treadmill (`share` 0) they run backward under it.
Motion walk(const Eigen::Vector3d& travel, double share) {
  Motion motion;
  motion.loop = true;
  motion.travel = share * travel;
  motion.frames.resize(15, kFrames);
  const double duty = 0.6;
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const double phase = static_cast<double>(f) / static_cast<double>(kFrames);
    const Eigen::Vector3d gone = share * phase * travel;
    for (int foot = 0; foot < 4; ++foot) {
      double own = phase + (foot % 3 == 0 ? 0 : 0.5);
      own -= std::floor(own);
      // Along the travel, seen from the trunk: from +duty/2 back to -duty/2 in stance, forth in swing.
      const double swing = (own - duty) / (1 - duty);
      const double along = own < duty ? duty / 2 - own : -duty / 2 + duty * (0.5 - 0.5 * std::cos(M_PI * swing));
      const double height = own < duty ? 0 : 0.1 * std::sin(M_PI * swing);
      motion.at(f).col(foot) = gone + Eigen::Vector3d(foot < 2 ? 0.4 : -0.4, height, foot % 2 == 0 ? 0.2 : -0.2) + along * travel;
    }
    motion.at(f).col(4) = gone + Eigen::Vector3d(0, 0.5, 0);
  }
  return motion;
}

/// As if the mass were spread evenly over the points.
RootMotionResult recovered(const Motion& motion, RootMotion mode) {
  Motion com = motion;
  com.frames.resize(3, motion.count());
  for (Eigen::Index f = 0; f < motion.count(); ++f) com.frames.col(f) = motion.at(f).rowwise().mean();
  return recover_root_motion(motion, com, 1, mode);
}

TEST(RecoverRootMotion, FindsTheSpeedOfATreadmill) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double heading = 2 * M_PI * uniform(random), stride = 0.2 + 0.6 * uniform(random);
    const Eigen::Vector3d travel(stride * std::cos(heading), 0, stride * std::sin(heading));
    const RootMotionResult result = recovered(walk(travel, 0), RootMotion::kAuto);
    ASSERT_TRUE(result.recovered);
    EXPECT_LT((result.travel - travel).norm(), 0.04 * stride);
    // The pace is even, and every course starts where it stands.
    EXPECT_EQ(result.offset.col(0).norm(), 0);
    for (Eigen::Index f = 0; f < kFrames; ++f) {
      EXPECT_LT((result.offset.col(f) - result.travel * (static_cast<double>(f) / kFrames)).norm(), 0.05 * stride);
      EXPECT_EQ(result.offset(1, f), 0);
    }
  }
}

TEST(RecoverRootMotion, FollowsAPaceThatChangesWithEachStep) {
  // Two feet on a treadmill whose speed swings by a third twice a period: one stands while the other comes back over it.
  Motion motion;
  motion.loop = true;
  motion.frames = Eigen::MatrixXd::Zero(9, kFrames);
  const auto gone = [](double phase) { return 0.6 * phase + 0.2 * std::sin(4 * M_PI * phase) / (4 * M_PI); };
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    for (int foot = 0; foot < 2; ++foot) {
      double own = static_cast<double>(f) / kFrames + 0.5 * foot;
      own -= std::floor(own);
      const double back = 2 * own - 1;
      motion.at(f).col(foot) << (own < 0.5 ? -gone(own) : -gone(0.5) * (1 - back)), own < 0.5 ? 0 : 0.1 * std::sin(M_PI * back), 0.1 * foot;
    }
    motion.at(f).col(2) << 0, 1, 0;
  }
  const RootMotionResult result = recovered(motion, RootMotion::kFromFeet);
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    // What goes beyond an even pace: 0.016 m at most.
    const double phase = static_cast<double>(f) / kFrames;
    EXPECT_NEAR(result.offset(0, f) - result.travel.x() * phase, gone(phase) - 0.6 * phase, 0.01) << "frame " << f;
  }
  EXPECT_NEAR(result.travel.x(), 0.6, 0.06) << "where the feet change, swing and stance are one";
}

/// A hop in place: two feet of `stand` frames on the ground, then the body of mass 10 to theirs in the air with gravity's rise, in which
/// the feet swing back and forth. Before launch and after landing the feet slide back under the body as it gathers and loses `speed` [m/s].
Motion hop(double speed, Eigen::Index stand) {
  Motion motion;
  motion.loop = true;
  motion.frames.resize(9, kFrames);
  const double flight = static_cast<double>(kFrames - stand) / 60;
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const double t = static_cast<double>(f - stand) / 60, rise = f < stand ? 0 : 9.81 / 2 * t * (flight - t);
    const double push = 6.0 / 60, since = static_cast<double>(f) / 60, left = -t;  // [s] of gathering speed
    double behind = 0;
    if (f < stand && since < push) behind = speed * (since - since * since / (2 * push)) - speed * push / 2;
    if (f < stand && left < push) behind = speed * (push - left) * (push - left) / (2 * push);
    if (f >= stand) behind = speed * push / 2 * std::cos(M_PI * t / flight) + 0.1 * std::pow(std::sin(M_PI * t / flight), 2);
    for (int foot = 0; foot < 2; ++foot) motion.at(f).col(foot) << -behind, 0.9 * rise, 0.1 * foot;
    motion.at(f).col(2) << 0, 0.4 + rise, 0.05;
  }
  return motion;
}

RootMotionResult recovered_hop(double speed, RootMotion mode) {
  const Motion motion = hop(speed, 24);
  Motion com = motion;
  com.frames = motion.frames.bottomRows(3);
  return recover_root_motion(motion, com, 1, mode);
}

TEST(RecoverRootMotion, AHopGoesOnEvenlyInTheAir) {
  for (const double speed : {0.6, 1.0, 1.5}) {
    SCOPED_TRACE("speed " + std::to_string(speed));
    const RootMotionResult result = recovered_hop(speed, RootMotion::kAuto);
    ASSERT_TRUE(result.recovered);
    const Eigen::RowVectorXd pace = 60 * (result.offset.rightCols(kFrames - 1) - result.offset.leftCols(kFrames - 1)).row(0);
    const Eigen::RowVectorXd air = pace.segment(26, 18), ground = pace.segment(8, 8);
    EXPECT_GT(air.mean(), 0.3 * speed);
    EXPECT_LT(air.mean(), 1.3 * speed);
    EXPECT_LT(air.maxCoeff() - air.minCoeff(), 0.25 * speed);
    EXPECT_LT(std::abs(ground.mean()), 0.25 * speed) << "feet that stand";
    EXPECT_NEAR(result.travel.x(), (result.offset(0, kFrames - 1) + pace[kFrames - 2] / 60), 0.02 * speed);
  }
}

TEST(RecoverRootMotion, AHopOfAMirrorImageGoesStraight) {
  for (const double lower : {-0.02, -0.01, 0.005, 0.01, 0.02}) {
    SCOPED_TRACE("one foot lower by " + std::to_string(lower));  // [m], and both slide apart in every stance
    Motion motion = hop(1, 24);
    for (Eigen::Index f = 0; f < kFrames; ++f) {
      const double spread = 0.05 * (f < 24 ? static_cast<double>(f) / 12 - 1 : std::cos(M_PI * static_cast<double>(f - 24) / 24));
      motion.at(f).col(0) += Eigen::Vector3d(0, -lower, -spread);
      motion.at(f).col(1) += Eigen::Vector3d(0, 0, spread);
    }
    Motion com = motion;
    com.frames = motion.frames.bottomRows(3);
    const RootMotionResult result = recover_root_motion(motion, com, 1, RootMotion::kAuto);
    ASSERT_TRUE(result.recovered);
    EXPECT_EQ(result.travel.z(), 0);
    EXPECT_EQ(result.offset.row(2).norm(), 0);
    EXPECT_GT(result.travel.x(), 0.1);
  }
}

TEST(RecoverRootMotion, AHopOnTheSpotStaysThere) {
  EXPECT_FALSE(recovered_hop(0, RootMotion::kAuto).recovered);
  EXPECT_LT(recovered_hop(0, RootMotion::kFromFeet).travel.norm(), 0.1);
}

TEST(RecoverRootMotion, LeavesATravellingClipAlone) {
  for (const RootMotion mode : {RootMotion::kAuto, RootMotion::kKeep}) {
    const RootMotionResult result = recovered(walk({0.5, 0, 0.2}, 1), mode);
    EXPECT_FALSE(result.recovered);
    EXPECT_EQ(result.offset.norm(), 0);
    EXPECT_EQ(result.travel.norm(), 0);
  }
}

TEST(RecoverRootMotion, LeavesAnIdleClipAlone) {
  const RootMotionResult result = recovered(walk({0.01, 0, 0}, 0), RootMotion::kAuto);
  EXPECT_FALSE(result.recovered);
  EXPECT_EQ(result.offset.norm(), 0);
}

TEST(RecoverRootMotion, FromFeetAddsNextToNothingToATravellingClip) {
  const RootMotionResult result = recovered(walk({0.5, 0, 0}, 1), RootMotion::kFromFeet);
  EXPECT_TRUE(result.recovered);
  EXPECT_LT(result.travel.norm(), 0.02);
}

TEST(RecoverRootMotion, KeepNeverMovesATreadmill) {
  EXPECT_FALSE(recovered(walk({0.5, 0, 0}, 0), RootMotion::kKeep).recovered);
}

TEST(RecoverRootMotion, NoneTakesTheTravelOfALoopAway) {
  const Motion motion = walk({0.5, 0, -0.2}, 1);
  const RootMotionResult result = recovered(motion, RootMotion::kNone);
  EXPECT_LT((motion.travel + result.travel).norm(), 1e-15);
  for (Eigen::Index f = 0; f < kFrames; ++f) {  // the trunk stands
    EXPECT_LT((motion.at(f).col(4) + result.offset.col(f) - motion.at(0).col(4)).norm(), 1e-12);
  }
}

TEST(RecoverRootMotion, NoneTakesTheTravelOfAOneShotAway) {
  Motion motion = walk({0.5, 0, -0.2}, 1);
  motion.loop = false;
  motion.travel.setZero();
  const RootMotionResult result = recovered(motion, RootMotion::kNone);
  EXPECT_EQ(result.travel.norm(), 0);
  const Eigen::Index last = kFrames - 1;
  const Eigen::Vector3d gone = (motion.at(last).rowwise().mean() + result.offset.col(last)) - motion.at(0).rowwise().mean();
  EXPECT_LT(std::hypot(gone.x(), gone.z()), 1e-12);
  EXPECT_EQ(result.offset.row(1).norm(), 0);
}

}  // namespace
}  // namespace hydrostat::retarget::root_motion_test

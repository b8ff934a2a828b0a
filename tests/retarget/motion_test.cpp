#include "retarget/motion.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <tuple>

namespace hydrostat::retarget::motion_test {
namespace {

/// Smooth random courses of `points` points: of a loop two harmonics, carried along and turned.
Motion random_motion(unsigned seed, bool loop, Eigen::Index frames = 24, Eigen::Index points = 5) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Motion motion;
  motion.rate_hz = 60;
  motion.loop = loop;
  if (loop) {
    motion.travel << uniform(random), 0, uniform(random);
    motion.yaw = uniform(random);
  }
  motion.frames.resize(3 * points, frames);
  for (Eigen::Index r = 0; r < 3 * points; ++r) {
    const double a = uniform(random), b = uniform(random), c = uniform(random), d = uniform(random);
    for (Eigen::Index f = 0; f < frames; ++f) {
      const double phase = 2 * M_PI * static_cast<double>(f) / static_cast<double>(frames);
      motion.frames(r, f) = a + 0.1 * (b * std::sin(phase) + c * std::cos(phase) + d * std::sin(2 * phase));
    }
  }
  if (!loop) return motion;
  // What repeats is the shape as the travelling, turning body sees it.
  for (Eigen::Index f = 0; f < frames; ++f) {
    const double share = static_cast<double>(f) / static_cast<double>(frames);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(share * motion.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    motion.at(f) = ((turn * motion.at(f)).colwise() + share * motion.travel).eval();
  }
  return motion;
}

Eigen::Matrix3Xd positions(const MotionCurve& curve, double time) {
  Eigen::Matrix3Xd x, v;
  curve.at(time, x, v);
  return x;
}

Eigen::Matrix3Xd speeds(const MotionCurve& curve, double time) {
  Eigen::Matrix3Xd x, v;
  curve.at(time, x, v);
  return v;
}

TEST(FrameAt, GoesRoundInALoopAndStaysAtTheEndOfAOneShot) {
  Motion motion;
  motion.rate_hz = 10;
  motion.frames = Eigen::MatrixXd::Zero(3, 4);
  for (const auto& [time, of_loop, of_one_shot] : {std::tuple{0.0, 0, 0}, {0.19, 1, 1}, {0.35, 3, 3}, {0.41, 0, 3}, {1.15, 3, 3}}) {
    motion.loop = true;
    EXPECT_EQ(frame_at(motion, time), of_loop) << time;
    motion.loop = false;
    EXPECT_EQ(frame_at(motion, time), of_one_shot) << time;
  }
}

TEST(AfterCycles, AreTheCyclesOneAfterAnother) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Motion motion = random_motion(seed, true);
    const Eigen::Vector3d place(1, 2, 3), once = Eigen::AngleAxisd(motion.yaw, Eigen::Vector3d::UnitY()) * place + motion.travel;
    EXPECT_LT((after_cycles(motion, 1) * place - once).norm(), 1e-14);
    EXPECT_LT((after_cycles(motion, 3) * place - after_cycles(motion, 1) * (after_cycles(motion, 2) * place)).norm(), 1e-13);
    EXPECT_LT((after_cycles(motion, -2) * (after_cycles(motion, 2) * place) - place).norm(), 1e-13);
  }
  EXPECT_TRUE(after_cycles(random_motion(0, false), 5).isApprox(Eigen::Isometry3d::Identity()));
}

TEST(PaddedFrames, OfALoopCarryOnItsTravelAndItsTurn) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Motion motion = random_motion(seed, true);
    const int pad = 60;  // two and a half periods
    const Eigen::MatrixXd padded = padded_frames(motion, pad);
    ASSERT_EQ(padded.cols(), motion.count() + 2 * pad);
    EXPECT_EQ(padded.middleCols(pad, motion.count()), motion.frames);
    for (Eigen::Index f = 0; f + motion.count() < padded.cols(); ++f) {
      for (Eigen::Index i = 0; i < padded.rows(); i += 3) {
        const Eigen::Vector3d now = padded.col(f).segment<3>(i), next = padded.col(f + motion.count()).segment<3>(i);
        EXPECT_LT((after_cycles(motion, 1) * now - next).norm(), 1e-12) << "padded frame " << f;
      }
    }
  }
}

TEST(PaddedFrames, OfAOneShotMirrorItsEnds) {
  const Motion motion = random_motion(3, false);
  const Eigen::MatrixXd padded = padded_frames(motion, 4);
  const Eigen::Index last = motion.count() - 1;
  for (int k = 1; k <= 4; ++k) {
    EXPECT_LT((padded.col(4 - k) + motion.frames.col(k) - 2 * motion.frames.col(0)).norm(), 1e-14);
    EXPECT_LT((padded.col(4 + last + k) + motion.frames.col(last - k) - 2 * motion.frames.col(last)).norm(), 1e-14);
  }
  EXPECT_LT(accelerations(motion).col(0).norm(), 1e-9);
  EXPECT_LT(accelerations(motion).col(last).norm(), 1e-9);
}

TEST(Accelerations, GiveAMotionItsSpeedFromRestAndTakeItBack) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Motion motion = random_motion(seed, false);
    const Eigen::Index last = motion.count() - 1;
    const Eigen::VectorXd first_step = motion.frames.col(1) - motion.frames.col(0), last_step = motion.frames.col(last) - motion.frames.col(last - 1);
    const auto steps = [&](RestingEnds ends) -> Eigen::VectorXd {  // what all accelerations together change of a frame's step
      return accelerations(motion, ends).rowwise().sum() / (motion.rate_hz * motion.rate_hz);
    };
    EXPECT_LT(steps({true, true}).norm(), 1e-12);
    EXPECT_LT((steps({true, false}) - last_step).norm(), 1e-12);
    EXPECT_LT((steps({false, true}) + first_step).norm(), 1e-12);
    EXPECT_LT((steps({}) - last_step + first_step).norm(), 1e-12);
  }
  const Motion loop = random_motion(1, true);
  EXPECT_EQ(accelerations(loop, {true, true}), accelerations(loop));
}

TEST(Differences, OfAParabolaAreExact) {
  Motion motion;
  motion.rate_hz = 50;
  motion.frames.resize(3, 9);
  const Eigen::Vector3d speed(1, 2, -3), acceleration(4, -9.81, 2);
  for (int f = 0; f < 9; ++f) {
    const double t = f / motion.rate_hz;
    motion.frames.col(f) = t * speed + 0.5 * t * t * acceleration;
  }
  for (int f = 1; f < 8; ++f) {
    EXPECT_LT((velocities(motion).col(f) - speed - acceleration * (f / motion.rate_hz)).norm(), 1e-11);
    EXPECT_LT((accelerations(motion).col(f) - acceleration).norm(), 1e-9);
  }
}

TEST(MotionCurve, PassesThroughItsFramesAndIsSmoothThere) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Motion motion = random_motion(seed, seed % 2 == 0);
    const MotionCurve curve(motion);
    for (Eigen::Index f = 0; f < motion.count(); ++f) {
      const double time = static_cast<double>(f) / motion.rate_hz;
      EXPECT_LT((positions(curve, time) - motion.at(f)).norm(), 1e-12) << "frame " << f;
      EXPECT_LT((positions(curve, time + 1e-9) - positions(curve, time - 1e-9)).norm(), 1e-7);
      EXPECT_LT((speeds(curve, time + 1e-9) - speeds(curve, time - 1e-9)).norm(), 1e-5) << "frame " << f;
    }
  }
}

TEST(MotionCurve, VelocityIsTheSlopeOfPosition) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Motion motion = random_motion(seed, seed % 2 == 0);
    const MotionCurve curve(motion);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> times(-0.1, 1.5 * motion.duration_s());
    const double h = 1e-6;
    for (int n = 0; n < 40; ++n) {
      const double time = times(random);
      const Eigen::Matrix3Xd slope = (positions(curve, time + h) - positions(curve, time - h)) / (2 * h);
      EXPECT_LT((speeds(curve, time) - slope).norm(), 1e-3) << "at " << time << " s";  // [m/s] half a step over a kink of slope
    }
  }
}

TEST(MotionCurve, OfALoopIsTheRigidMoveAwayAfterAnyNumberOfCycles) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Motion motion = random_motion(seed, true);
    const MotionCurve curve(motion);
    for (const int cycles : {-3, -1, 1, 4}) {
      const double time = 0.013 * seed, later = time + cycles * motion.duration_s();
      const Eigen::Isometry3d move = after_cycles(motion, cycles);
      EXPECT_LT(((move.linear() * positions(curve, time)).colwise() + move.translation() - positions(curve, later)).norm(), 1e-10);
      EXPECT_LT((move.linear() * speeds(curve, time) - speeds(curve, later)).norm(), 1e-9);
    }
  }
}

TEST(MotionCurve, OfAOneShotHoldsItsEndsAtRest) {
  const Motion motion = random_motion(5, false);
  const MotionCurve curve(motion);
  for (const double before : {-10.0, -0.01, 0.0}) {
    EXPECT_LT((positions(curve, before) - motion.at(0)).norm(), 1e-14);
    EXPECT_EQ(speeds(curve, before).norm(), 0);
  }
  for (const double after : {0.0, 0.01, 10.0}) {
    EXPECT_LT((positions(curve, motion.duration_s() + after) - motion.at(motion.count() - 1)).norm(), 1e-14);
    EXPECT_EQ(speeds(curve, motion.duration_s() + after).norm(), 0);
  }
}

TEST(MotionCurve, OfASingleFrameStands) {
  const Motion motion = random_motion(5, false, 1);
  const MotionCurve curve(motion);
  for (const double time : {-1.0, 0.0, 1.0}) {
    EXPECT_LT((positions(curve, time) - motion.at(0)).norm(), 1e-14);
    EXPECT_EQ(speeds(curve, time).norm(), 0);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::motion_test

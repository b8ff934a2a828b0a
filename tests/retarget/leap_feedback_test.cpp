#include "retarget/leap_feedback.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::leap_feedback_test {
namespace {

constexpr double kLength = BoxCreature::kLength;
constexpr long kFrames = 60, kTakeOff = 30, kLanding = 45;  // at 60 Hz

/// A box that goes `stride` [m] along x and turns by `yaw` [rad] in a cycle of 1 s; nothing touches in the frames from take-off to landing.
PreparedTarget hopping(double stride = 2 * kLength, double yaw = 0, bool loop = true, bool flies = true) {
  const BoxCreature creature = make_box_creature();
  PreparedTarget plan = as_prepared(standing(creature, kFrames), always_standing(creature, kFrames));
  plan.target.loop = loop;
  plan.target.travel.x() = stride;
  plan.target.yaw = yaw;
  for (auto& states : plan.contacts.state) {
    if (flies) std::fill(states.begin() + kTakeOff, states.begin() + kLanding, ContactState::kOff);
  }
  return plan;
}

/// What the reference's velocity changes by at a time.
Eigen::Vector3d lead_at(const LeapFeedback& feedback, double time_s, double yaw = 0) {
  physics::State reference{Eigen::Matrix3Xd::Zero(3, 4), Eigen::Matrix3Xd::Zero(3, 4)};
  feedback.apply(time_s, yaw, 0, Eigen::Vector3d::Zero(), reference);
  EXPECT_TRUE(reference.x.isZero(0));
  EXPECT_TRUE(reference.v.isApprox(reference.v.col(0).replicate(1, 4)) || reference.v.isZero(0));
  return reference.v.col(0);
}

TEST(LeapFeedback, LeadsAgainstTheErrorWhileThePushOffLastsAndAtNoOtherTime) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-0.1 * kLength, 0.1 * kLength);
    const WayError error(0.1, place(random), place(random));
    const PreparedTarget plan = hopping();
    LeapFeedback feedback(plan, kLength);
    feedback.end_cycle(error);
    for (long cycle = 1; cycle < 4; ++cycle) {
      for (long f = 0; f < kFrames; ++f) {
        const Eigen::Vector3d lead = lead_at(feedback, static_cast<double>(cycle) + (static_cast<double>(f) + 0.5) / kFrames);
        const bool pushes_off = f >= kTakeOff - 6 && f < kTakeOff;
        EXPECT_EQ(!lead.isZero(0), pushes_off) << "frame " << f;
        if (!pushes_off) continue;
        EXPECT_NEAR(lead.x(), -2 * error[1], 1e-12);
        EXPECT_NEAR(lead.z(), -0.4 * error[2], 1e-12);
        EXPECT_EQ(lead.y(), 0);
      }
    }
    feedback.end_cycle(WayError::Zero());
    EXPECT_TRUE(feedback.lead().isZero(0));
  }
}

TEST(LeapFeedback, IsBoundedWhateverTheError) {
  const PreparedTarget plan = hopping();
  LeapFeedback feedback(plan, kLength);
  for (const double far : {1.0, -50.0}) {
    feedback.end_cycle(WayError(0, far, 0));
    EXPECT_NEAR(feedback.lead().x(), -std::copysign(kLength, far), 1e-12);
    feedback.end_cycle(WayError(0, 0, far * 10));
    EXPECT_NEAR(feedback.lead().z(), -std::copysign(0.5 * kLength, far), 1e-12);
  }
}

TEST(LeapFeedback, LeadsAsTheCycleAndTheReferenceAreTurned) {
  const double yaw = 0.3, glide = 0.1, push_off = (kTakeOff - 0.5) / kFrames;
  const PreparedTarget plan = hopping(2 * kLength, yaw);
  LeapFeedback feedback(plan, kLength);
  feedback.end_cycle(WayError(0, 0.02, -0.03));
  for (const double cycle : {0.0, 1.0, 5.0}) {
    const Eigen::Vector3d expected = Eigen::AngleAxisd(cycle * yaw + glide, Eigen::Vector3d::UnitY()) * feedback.lead();
    EXPECT_LT((lead_at(feedback, cycle + push_off, glide) - expected).norm(), 1e-12);
  }
}

TEST(LeapFeedback, ALeapOnTheSpotIsHeldThereAlikeToAllSides) {
  const PreparedTarget plan = hopping(0);
  LeapFeedback feedback(plan, kLength);
  for (const double angle : {0.0, 1.0, 2.5}) {
    feedback.end_cycle(WayError(0, 0.05 * std::cos(angle), 0.05 * std::sin(angle)));
    EXPECT_LT((feedback.lead() + 0.4 * 0.05 * Eigen::Vector3d(std::cos(angle), 0, std::sin(angle))).norm(), 1e-12);
  }
}

TEST(LeapFeedback, TurnsTheReferenceBackToItsWayAboutItsCentreWhileThePushOffLasts) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> draw(-1, 1);
    const PreparedTarget plan = hopping();
    const LeapFeedback feedback(plan, kLength);
    physics::State reference{Eigen::Matrix3Xd::NullaryExpr(3, 5, [&] { return draw(random); }), Eigen::Matrix3Xd::Zero(3, 5)};
    const Eigen::Matrix3Xd places = reference.x;
    const Eigen::Vector3d com(draw(random), draw(random), draw(random));
    const double turn = 2 * draw(random), spin = -std::clamp(5 * turn, -3.0, 3.0);
    feedback.apply((kTakeOff + 0.5) / kFrames, 0, turn, com, reference);
    EXPECT_TRUE(reference.v.isZero(0)) << "in flight";
    feedback.apply((kTakeOff - 0.5) / kFrames, 0, turn, com, reference);
    EXPECT_EQ(reference.x, places);
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d arm = places.col(i) - com;
      EXPECT_LT((reference.v.col(i) - spin * Eigen::Vector3d(arm.z(), 0, -arm.x())).norm(), 1e-12);
    }
  }
}

TEST(LeapFeedback, HardlyCorrectsPitchAndRollWhileThePushOffLasts) {
  const PreparedTarget plan = hopping(), standing_still = hopping(1, 0, true, false);
  const LeapFeedback feedback(plan, kLength), none(standing_still, kLength);
  for (long f = 0; f < 3 * kFrames; ++f) {
    const double time_s = (static_cast<double>(f) + 0.5) / kFrames;
    const bool pushes_off = f % kFrames >= kTakeOff - 6 && f % kFrames < kTakeOff;
    EXPECT_EQ(feedback.upright(time_s), pushes_off ? 0.2 : 1) << "frame " << f;
    EXPECT_EQ(none.upright(time_s), 1);
  }
}

TEST(LeapFeedback, LeavesAloneWhatNeverFliesOrIsPlayedOnce) {
  for (const PreparedTarget& plan : {hopping(1, 0, true, false), hopping(1, 0, false, true)}) {
    LeapFeedback feedback(plan, kLength);
    EXPECT_FALSE(feedback.is_needed());
    feedback.end_cycle(WayError(0, 0.05, 0.05));
    for (long f = 0; f < kFrames; ++f) EXPECT_TRUE(lead_at(feedback, (static_cast<double>(f) + 0.5) / kFrames).isZero(0));
  }
}

}  // namespace
}  // namespace hydrostat::retarget::leap_feedback_test

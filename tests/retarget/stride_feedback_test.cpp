#include "retarget/stride_feedback.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hydrostat::retarget::stride_feedback_test {
namespace {

constexpr double kStride = 0.25, kPeriod = 2, kStep = 1.0 / 120;

/// A rung ladder along z: nodes left (+x) and right of the way, at z = 0 and 1.
const Eigen::Matrix2Xi kConstraints = (Eigen::Matrix2Xi(2, 3) << 0, 2, 0, 1, 3, 2).finished();  // left, right, rung

/// A body that travels `stride` [m] along z a cycle and stretches by `stretch` [m] on the way, its only patch in `state`.
PreparedTarget travelling(double stride, ContactState state, bool loop = true, double stretch = kStride) {
  PreparedTarget plan;
  plan.target.rate_hz = 30;
  plan.target.loop = loop;
  plan.target.frames.resize(12, 60);
  for (Eigen::Index f = 0; f < 60; ++f) {
    const double z = stride * static_cast<double>(f) / 60, end = z + 1 + stretch * 0.5 * std::sin(2 * M_PI * static_cast<double>(f) / 60);
    plan.target.frames.col(f) << 0.1, 0, z, 0.1, 0, end, -0.1, 0, z, -0.1, 0, end;
  }
  plan.target.travel.z() = stride;
  plan.contacts.patches.resize(1);
  plan.contacts.state = {std::vector<ContactState>(60, state)};
  return plan;
}

void wave(double time_s, Eigen::VectorXd& activation) {
  for (int e = 0; e < 3; ++e) activation[e] = 1 + 0.01 * e + 0.2 * std::sin(2 * M_PI * time_s / kPeriod + e);
}

/// The feedback once the body has lain `off` [m] and been turned by `yaw` [rad] from its target for ten seconds.
StrideFeedback after(const PreparedTarget& plan, const Eigen::Vector3d& off, double yaw) {
  StrideFeedback feedback(plan, 1, kConstraints, wave);
  const Eigen::Vector3d target(0, 0.1, 0.3);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  for (int k = 0; k < 1200; ++k) feedback.follow({turned, target, target + off, 0}, kStep);
  return feedback;
}

/// How far activations are from their mean, against before, once the body has lagged by `lag` [m]: those of the rung, which does
/// not steer. Turned by `yaw` [rad] meanwhile.
double swing(const PreparedTarget& plan, const Eigen::Vector3d& lag, double yaw = 0) {
  const StrideFeedback feedback = after(plan, -lag, yaw);
  Eigen::VectorXd activation(3);
  wave(0.3, activation);
  const double before = activation[2] - 1.02;
  feedback.apply(0.3, activation);
  return (activation[2] - 1.02) / before;
}

/// By how much longer the left side is commanded than the right at a time [s], for that reason alone that the body is off.
double longer_on_the_left(const PreparedTarget& plan, double time_s, double left, double yaw) {
  Eigen::VectorXd activation = Eigen::VectorXd::Ones(3);
  after(plan, {left, 0, 0}, yaw).apply(time_s, activation);
  return activation[0] - activation[1];
}

TEST(StrideFeedback, LengthensStridesByTheShareThatIsLostAndShortensThemWhereTheBodyIsAhead) {
  const PreparedTarget plan = travelling(kStride, ContactState::kSlide);
  EXPECT_NEAR(swing(plan, {0, 0, 0.05 * kStride}), 1.05, 1e-3);
  EXPECT_NEAR(swing(plan, {0, 0, -0.05 * kStride}), 0.95, 1e-3);
  EXPECT_NEAR(swing(plan, {0, 0, 3 * kStride}), 1.1, 1e-3);
  EXPECT_EQ(swing(plan, {0.05, 0.05, 0}), 1);
}

TEST(StrideFeedback, LengthensNoStridesOfWhatIsBentAsFarAsItMayBe) {
  const PreparedTarget plan = travelling(kStride, ContactState::kSlide);
  const Eigen::Vector3d lag(0, 0, kStride);
  const double most = std::abs(after(plan, {0, 0, 0}, 1).steering());
  for (const double side : {-1.0, 1.0}) {
    EXPECT_NEAR(swing(plan, lag, side * 0.7 * most / 20), 1.1, 1e-3) << "there is bend to spare";
    EXPECT_NEAR(swing(plan, lag, side * 0.9 * most / 20), 1.04, 1e-3) << "two fifths of what must be spare";
    EXPECT_NEAR(swing(plan, lag, side * 0.2), 1, 1e-3);
    EXPECT_NEAR(swing(plan, -lag, side * 0.2), 1, 1e-3) << "nor shortens them";
  }
  const PreparedTarget straight = travelling(kStride, ContactState::kSlide, true, 0.4 * kStride);
  EXPECT_NEAR(swing(straight, lag, 0.2), 1.1, 1e-3) << "what does not steer has none to spare";
}

TEST(StrideFeedback, LeavesAloneWhatStepsFreelyStandsOrIsPlayedOnce) {
  const Eigen::Vector3d lag(0, 0, 0.02);
  EXPECT_EQ(swing(travelling(kStride, ContactState::kStick), lag), 1);
  EXPECT_EQ(swing(travelling(0.01, ContactState::kSlide), lag), 1);
  EXPECT_EQ(swing(travelling(kStride, ContactState::kSlide, /*loop=*/false), lag), 1);
}

TEST(StrideFeedback, BendsAwayFromTheErrorWhileItStretchesAndBackWhileItShortens) {
  const PreparedTarget plan = travelling(kStride, ContactState::kSlide);
  const double longest = 0.25 * kPeriod, shortest = 0.75 * kPeriod;
  // Turned to the left (about +y, which takes z to x), or off to the left: the front end is to go to the right, so that the body
  // is longer on the left when it is long.
  for (const auto& [left, yaw] : {std::pair(0.0, 0.01), std::pair(0.02, 0.0), std::pair(0.3, 0.2)}) {
    EXPECT_GT(longer_on_the_left(plan, longest, left, yaw), 1e-3) << left << " " << yaw;
    EXPECT_LT(longer_on_the_left(plan, shortest, left, yaw), -1e-3) << left << " " << yaw;
    EXPECT_NEAR(longer_on_the_left(plan, longest, -left, -yaw), -longer_on_the_left(plan, longest, left, yaw), 1e-9);
    EXPECT_LE(longer_on_the_left(plan, longest, left, yaw), 0.2 + 1e-9);
  }
  // On its way back to the path it is left alone.
  EXPECT_NEAR(longer_on_the_left(plan, longest, 0.04, -0.04 / (4 * kStride)), 0, 1e-9);
  EXPECT_EQ(longer_on_the_left(plan, longest, 0, 0), 0);
}

TEST(StrideFeedback, DoesNotSteerWhatTravelsByOtherMeansThanStretching) {
  const PreparedTarget stiff = travelling(kStride, ContactState::kSlide, true, 0.4 * kStride);
  EXPECT_EQ(longer_on_the_left(stiff, 0.5, 0.1, 0.1), 0);
  EXPECT_NEAR(swing(stiff, {0, 0, 0.05 * kStride}), 1.05, 1e-3);
}

}  // namespace
}  // namespace hydrostat::retarget::stride_feedback_test

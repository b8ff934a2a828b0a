#include "retarget/stride_feedback.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr int kConstraints = 3;
constexpr double kStride = 0.25, kPeriod = 2, kStep = 1.0 / 120;

/// A point that travels `stride` [m] along z a cycle, its only patch in `state`.
PreparedTarget travelling(double stride, ContactState state, bool loop = true) {
  PreparedTarget plan;
  plan.target.rate_hz = 30;
  plan.target.loop = loop;
  plan.target.frames = Eigen::MatrixXd::Zero(3, 60);
  for (Eigen::Index f = 0; f < 60; ++f) plan.target.frames(2, f) = stride * static_cast<double>(f) / 60;
  plan.target.travel.z() = stride;
  plan.contacts.patches.resize(1);
  plan.contacts.state = {std::vector<ContactState>(60, state)};
  return plan;
}

void wave(double time_s, Eigen::VectorXd& activation) {
  for (int e = 0; e < kConstraints; ++e) activation[e] = 1 + 0.01 * e + 0.2 * std::sin(2 * M_PI * time_s / kPeriod + e);
}

/// How far activations are from their mean, against before, once the body has lagged by `lag` [m] for ten seconds.
double swing(const PreparedTarget& plan, const Eigen::Vector3d& lag) {
  StrideFeedback feedback(plan, 1, kConstraints, wave);
  for (int k = 0; k < 1200; ++k) feedback.follow(Eigen::Vector3d(0, 0.1, 0.3), Eigen::Vector3d(0, 0.1, 0.3) - lag, kStep);
  Eigen::VectorXd activation(kConstraints);
  wave(0.3, activation);
  const double before = activation[2] - 1.02;
  feedback.apply(activation);
  return (activation[2] - 1.02) / before;
}

TEST(StrideFeedback, LengthensStridesByTheShareThatIsLostAndShortensThemWhereTheBodyIsAhead) {
  const PreparedTarget plan = travelling(kStride, ContactState::kSlide);
  EXPECT_NEAR(swing(plan, {0, 0, 0.05 * kStride}), 1.05, 1e-3);
  EXPECT_NEAR(swing(plan, {0, 0, -0.05 * kStride}), 0.95, 1e-3);
  EXPECT_NEAR(swing(plan, {0, 0, 3 * kStride}), 1.1, 1e-3);
  EXPECT_EQ(swing(plan, {0.05, 0.05, 0}), 1);
}

TEST(StrideFeedback, LeavesAloneWhatStepsFreelyStandsOrIsPlayedOnce) {
  const Eigen::Vector3d lag(0, 0, 0.02);
  EXPECT_EQ(swing(travelling(kStride, ContactState::kStick), lag), 1);
  EXPECT_EQ(swing(travelling(0.01, ContactState::kSlide), lag), 1);
  EXPECT_EQ(swing(travelling(kStride, ContactState::kSlide, /*loop=*/false), lag), 1);
}

}  // namespace
}  // namespace hydrostat::retarget

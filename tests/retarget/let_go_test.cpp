#include "retarget/let_go.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace hydrostat::retarget::let_go_test {
namespace {

using enum ContactState;
constexpr Eigen::Index kFrames = 20, kLast = 9;  // the last frame in which the first foot stands

struct Stance {
  Motion points;
  ContactSchedule contacts;
};

/// Two feet of two points each. The first stands until frame kLast and then goes sideways with `speed` [m/s]; the second stands
/// until frame `second_last` and stays where it is.
Stance two_feet(double speed, double angle, Eigen::Index second_last) {
  Stance stance;
  stance.points.rate_hz = 60;
  stance.points.loop = false;
  stance.points.frames = Eigen::MatrixXd::Zero(12, kFrames);
  stance.contacts.patches = {{"fore", {0, 1}, true}, {"hind", {2, 3}, true}};
  stance.contacts.state.assign(2, std::vector<ContactState>(kFrames, kOff));
  stance.contacts.touching = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(4, kFrames, false);
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const double gone = speed * static_cast<double>(std::max<Eigen::Index>(0, f - kLast)) / stance.points.rate_hz;
    for (int p = 0; p < 2; ++p) stance.points.at(f).col(p) << gone * std::cos(angle), 0, gone * std::sin(angle) + 0.1 * p;
    for (int p = 2; p < 4; ++p) stance.points.at(f).col(p) << -0.5, 0, 0.1 * p;
    const Eigen::Index last[] = {kLast, second_last};
    for (std::size_t k = 0; k < 2; ++k) {
      if (f > last[k]) continue;
      stance.contacts.state[k][static_cast<std::size_t>(f)] = kStick;
      for (const int p : stance.contacts.patches[k].points) stance.contacts.touching(p, f) = true;
    }
  }
  return stance;
}

/// Whether foot k bears in frame f, by its state and by each of its points, which must agree.
bool bears(const ContactSchedule& contacts, std::size_t k, Eigen::Index f) {
  const bool by_state = contacts.state[k][static_cast<std::size_t>(f)] != kOff;
  for (const int p : contacts.patches[k].points) EXPECT_EQ(contacts.touching(p, f), by_state);
  return by_state;
}

TEST(LetGo, WhatFliesOffBearsNothingInItsLastFrame) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Stance stance = two_feet(std::uniform_real_distribution<>(1.01, 5)(random), std::uniform_real_distribution<>(0, 6)(random), 15);
    let_go(stance.points, 1, stance.contacts);
    EXPECT_FALSE(bears(stance.contacts, 0, kLast));
    EXPECT_TRUE(bears(stance.contacts, 0, kLast - 1)) << "it stands still until the frame after";
    for (Eigen::Index f = 0; f <= 15; ++f) EXPECT_TRUE(bears(stance.contacts, 1, f));
    const ContactSchedule once = stance.contacts;
    let_go(stance.points, 1, stance.contacts);
    EXPECT_EQ(stance.contacts.state, once.state) << "a second look changes nothing";
  }
}

TEST(LetGo, WhatLeavesSlowlyBearsToTheEnd) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Stance stance = two_feet(std::uniform_real_distribution<>(0, 0.99)(random), std::uniform_real_distribution<>(0, 6)(random), 15);
    const std::vector<std::vector<ContactState>> before = stance.contacts.state;
    let_go(stance.points, 1, stance.contacts);
    EXPECT_EQ(stance.contacts.state, before);
  }
}

TEST(LetGo, WhatLiftsStraightUpBearsToTheEnd) {
  Stance stance = two_feet(0, 0, 15);
  for (Eigen::Index f = kLast + 1; f < kFrames; ++f) stance.points.at(f).leftCols(2).row(1).array() += 0.1 * static_cast<double>(f - kLast);
  let_go(stance.points, 1, stance.contacts);
  EXPECT_TRUE(bears(stance.contacts, 0, kLast));
}

TEST(LetGo, TheLastThatHoldsLaunchesTheBody) {
  Stance alone = two_feet(3, 0, kLast - 3);
  let_go(alone.points, 1, alone.contacts);
  EXPECT_TRUE(bears(alone.contacts, 0, kLast));
}

TEST(LetGo, WhatIsDraggedStaysDragged) {
  Stance stance = two_feet(3, 0, 15);
  stance.contacts.state[0][kLast] = kSlide;
  let_go(stance.points, 1, stance.contacts);
  EXPECT_EQ(stance.contacts.state[0][kLast], kSlide);
}

TEST(LetGo, TheSeamOfALoopIsAStepLikeOthers) {
  // The first foot stands in the second half of the period and flies off over the seam.
  Stance stance = two_feet(0, 0, kFrames - 1);
  stance.points.loop = true;
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const bool stands = f > kLast;
    if (!stands) stance.points.at(f).leftCols(2).row(0).setConstant(0.1);
    stance.contacts.state[0][static_cast<std::size_t>(f)] = stands ? kStick : kOff;
    for (const int p : {0, 1}) stance.contacts.touching(p, f) = stands;
  }
  let_go(stance.points, 1, stance.contacts);
  EXPECT_FALSE(bears(stance.contacts, 0, kFrames - 1));
  EXPECT_TRUE(bears(stance.contacts, 0, kLast + 1)) << "what lands bears at once";
}

}  // namespace
}  // namespace hydrostat::retarget::let_go_test

#include "retarget/contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace hydrostat::retarget::contacts_test {
namespace {

constexpr double kLength = 1, kSize = 0.4;  // [m]: a patch touches below 12 mm
constexpr Eigen::Index kFrames = 60;
using enum ContactState;

/// Bone 0: a head that swings to and fro at half a metre, so that there is a speed to compare with. Bone 1: a foot of two points
/// whose height and place along x [m] are given per frame.
template <typename Foot>
Motion head_and_foot(const Foot& foot, bool loop = true, Eigen::Index frames = kFrames) {
  Motion motion;
  motion.loop = loop;
  motion.frames = Eigen::MatrixXd::Zero(9, frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const double phase = 2 * M_PI * static_cast<double>(f) / static_cast<double>(frames);
    motion.at(f).col(0) << 0.2 * std::sin(phase), 0.5, 0;
    const Eigen::Vector2d place = foot(f);
    motion.at(f).col(1) << place.x(), place.y(), 0;
    motion.at(f).col(2) << place.x() + 0.05, place.y(), 0.05;
  }
  return motion;
}

ContactSchedule label(const Motion& motion, const ContactOptions& options = {}) {
  return label_contacts(motion, {0, 1, 1}, {"head", "foot"}, kLength, kSize, options);
}

long frames_in(const ContactSchedule& contacts, ContactState state) {
  return std::count(contacts.state[0].begin(), contacts.state[0].end(), state);
}

TEST(LabelContacts, AFootThatStandsSticks) {
  const ContactSchedule contacts = label(head_and_foot([](Eigen::Index) { return Eigen::Vector2d(0, 0.001); }));
  ASSERT_EQ(contacts.patches.size(), 1u) << "the head never touches";
  EXPECT_EQ(contacts.patches[0].name, "foot");
  EXPECT_EQ(contacts.patches[0].points, (std::vector<int>{1, 2}));
  EXPECT_EQ(frames_in(contacts, kStick), kFrames);
  EXPECT_TRUE(contacts.touching.row(1).all() && contacts.touching.row(2).all());
  EXPECT_FALSE(contacts.touching.row(0).any());
  EXPECT_EQ(contacts.flight_s(60), 0);
}

TEST(LabelContacts, AFootThatIsLiftedIsOff) {
  // Down in frames 0 to 29, then an arc of 0.1 m.
  const ContactSchedule contacts = label(head_and_foot([](Eigen::Index f) {
    return Eigen::Vector2d(0, f < 30 ? 0 : 0.1 * std::sin(M_PI * static_cast<double>(f - 29) / 31));
  }));
  ASSERT_EQ(contacts.patches.size(), 1u);
  for (std::size_t f = 2; f < 28; ++f) EXPECT_EQ(contacts.state[0][f], kStick) << "frame " << f;
  for (std::size_t f = 34; f < 56; ++f) EXPECT_EQ(contacts.state[0][f], kOff) << "frame " << f;
  EXPECT_FALSE(contacts.touching(1, 45));
  EXPECT_NEAR(contacts.flight_s(60), static_cast<double>(frames_in(contacts, kOff)) / 60, 1e-12);
}

TEST(LabelContacts, ADraggedFootSlidesAlongItsWay) {
  // A triangle along x: half a period forth, half a period back, always on the ground.
  const ContactSchedule contacts = label(head_and_foot([](Eigen::Index f) {
    return Eigen::Vector2d(0.02 * static_cast<double>(f < 30 ? f : 60 - f), 0);
  }));
  ASSERT_EQ(contacts.patches.size(), 1u);
  EXPECT_GE(frames_in(contacts, kSlide), kFrames - 4);
  EXPECT_EQ(frames_in(contacts, kOff), 0);
  for (const Eigen::Index f : {5, 15, 25}) EXPECT_NEAR(contacts.sliding_x(0, f), 1, 1e-9);
  for (const Eigen::Index f : {35, 45, 55}) EXPECT_NEAR(contacts.sliding_x(0, f), -1, 1e-9);
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const double norm = std::hypot(contacts.sliding_x(0, f), contacts.sliding_z(0, f));
    EXPECT_LE(norm, contacts.state[0][static_cast<std::size_t>(f)] == kSlide ? 1 + 1e-12 : 0);
  }
}

TEST(LabelContacts, WhatIsDraggedAndSlowForAMomentDoesNotStand) {
  for (const int pause : {3, 5, 7, 12}) {
    SCOPED_TRACE("frames at rest: " + std::to_string(pause));
    const Motion dragged = head_and_foot([pause](Eigen::Index f) {
      return Eigen::Vector2d(0.02 * static_cast<double>(f < 20 ? f : std::max<Eigen::Index>(20, f - pause)), 0);
    }, false);
    const ContactSchedule contacts = label(dragged);
    ASSERT_EQ(contacts.patches.size(), 1u);
    if (pause == 12) {
      EXPECT_EQ(contacts.state[0][26], kStick) << "a rest of 0.2 s is a stance";
      continue;
    }
    for (std::size_t f = 14; f < 34; ++f) EXPECT_NE(contacts.state[0][f], kStick) << "frame " << f;
  }
}

TEST(LabelContacts, ShortRunsAreClosed) {
  // Stands, but for a hop of one frame; hovers, but for a touch of two.
  const ContactSchedule hop = label(head_and_foot([](Eigen::Index f) { return Eigen::Vector2d(0, f == 20 ? 0.03 : 0); }));
  EXPECT_EQ(frames_in(hop, kStick), kFrames);
  const ContactSchedule touch = label(head_and_foot([](Eigen::Index f) { return Eigen::Vector2d(0, f == 20 || f == 21 ? 0 : 0.05); }));
  EXPECT_TRUE(touch.patches.empty());
}

TEST(LabelContacts, ABrushOfTheGroundIsNoDrag) {
  // Skims the ground for six frames at full speed.
  const auto foot = [](Eigen::Index f) { return Eigen::Vector2d(0.02 * static_cast<double>(f < 30 ? f : 60 - f), f >= 10 && f < 16 ? 0 : 0.05); };
  EXPECT_TRUE(label(head_and_foot(foot)).patches.empty());
}

TEST(LabelContacts, OfALoopDoNotHangOnWhereItStarts) {
  const auto height = [](Eigen::Index f) { return f % kFrames < 25 ? 0.0 : 0.1 * std::sin(M_PI * static_cast<double>(f % kFrames - 24) / 36); };
  const ContactSchedule first = label(head_and_foot([&](Eigen::Index f) { return Eigen::Vector2d(0, height(f)); }));
  for (const Eigen::Index shift : {7, 12, 24, 25, 40}) {
    SCOPED_TRACE("shift " + std::to_string(shift));
    const ContactSchedule later = label(head_and_foot([&](Eigen::Index f) { return Eigen::Vector2d(0, height(f + shift)); }));
    ASSERT_EQ(later.patches.size(), 1u);
    for (Eigen::Index f = 0; f < kFrames; ++f) {
      EXPECT_EQ(later.state[0][static_cast<std::size_t>(f)], first.state[0][static_cast<std::size_t>((f + shift) % kFrames)]) << "frame " << f;
    }
  }
}

TEST(LabelContacts, KeepsTheirContactLongerThanTheyTakeIt) {
  // Heights between the threshold and its hysteresis: a foot that comes from above is not yet down, one that stood still is.
  const double reach = 0.03 * kSize, between = 1.25 * reach;
  const auto contacts = label(head_and_foot([&](Eigen::Index f) { return Eigen::Vector2d(0, f < 20 ? 0.05 : f < 40 ? 0 : between); }, false));
  ASSERT_EQ(contacts.patches.size(), 1u);
  EXPECT_EQ(contacts.state[0][50], kStick);
  EXPECT_TRUE(label(head_and_foot([&](Eigen::Index) { return Eigen::Vector2d(0, between); }, false)).patches.empty());
}

/// Down in frames 0 to 19, and 30 mm above the ground in the others, while the head rises over its way by `share` of what free
/// fall for that time would have it rise.
Motion hovering_foot(double share) {
  Motion motion = head_and_foot([](Eigen::Index f) { return Eigen::Vector2d(0, f < 20 ? 0 : 0.03); });
  for (Eigen::Index f = 20; f < kFrames; ++f) {
    const double left = static_cast<double>(f - 19) / 60, right = static_cast<double>(kFrames - f) / 60;
    motion.at(f)(1, 0) += 3 * share * 0.5 * 9.81 * left * right;  // three points make the middle, the head is one
  }
  return motion;
}

TEST(LabelContacts, WhatDoesNotFallStandsOnItsLowestFoot) {
  EXPECT_EQ(frames_in(label(hovering_foot(0)), kOff), 0);
  EXPECT_EQ(frames_in(label(hovering_foot(0.3)), kOff), 0);
  EXPECT_GE(frames_in(label(hovering_foot(1)), kOff), kFrames - 20 - 2) << "free fall is a flight";
  ContactOptions strict;
  strict.support_height = 0.02;
  EXPECT_GE(frames_in(label(hovering_foot(0), strict), kOff), kFrames - 20 - 2) << "a foot that far up bears nothing";
}

TEST(LabelContacts, AFootThatGlidesForAMomentInItsStanceStands) {
  const ContactSchedule contacts = label(head_and_foot([](Eigen::Index f) {
    return Eigen::Vector2d(0.02 * static_cast<double>(std::clamp<Eigen::Index>(f - 30, 0, 6)), f < 55 ? 0 : 0.2);
  }));
  for (std::size_t f = 2; f < 53; ++f) EXPECT_EQ(contacts.state[0][f], kStick) << "frame " << f;
}

/// Feet 1 and 2, left and right of a head: down for half of a loop and then in an arc, the right one `higher` [m] all the while and
/// `lag` frames behind.
Motion head_and_two_feet(double higher, Eigen::Index lag) {
  Motion motion;
  motion.loop = true;
  motion.frames = Eigen::MatrixXd::Zero(9, kFrames);
  const auto rise = [](Eigen::Index f) { return f < 30 ? 0 : 0.2 * std::sin(M_PI * static_cast<double>(f - 30) / 30); };
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    motion.at(f).col(0) << 0, 0.5 + 0.2 * std::sin(2 * M_PI * static_cast<double>(f) / kFrames), 0;
    motion.at(f).col(1) << -0.1, rise(f), 0;
    motion.at(f).col(2) << 0.1, higher + rise((f + kFrames - lag) % kFrames), 0;
  }
  return motion;
}

ContactSchedule label_two_feet(const Motion& motion, const std::vector<std::array<int, 2>>& mirrored) {
  return label_contacts(motion, {0, 1, 2}, {"head", "left", "right"}, kLength, kSize, {}, mirrored);
}

TEST(LabelContacts, MirroredFeetThatRiseTogetherTouchTogether) {
  for (const double higher : {0.008, 0.011, 0.013, 0.016, 0.02}) {  // a patch touches below 12 mm
    SCOPED_TRACE("higher by " + std::to_string(higher));
    const Motion hop = head_and_two_feet(higher, 0);
    const ContactSchedule alone = label_two_feet(hop, {}), together = label_two_feet(hop, {{1, 2}});
    ASSERT_EQ(together.patches.size(), 2u);
    EXPECT_TRUE(together.state[0] == alone.state[0]);
    EXPECT_TRUE(together.state[1] == alone.state[0]);
    EXPECT_EQ(alone.patches.size(), higher < 0.012 ? 2u : 1u) << "else it tests nothing";
  }
}

TEST(LabelContacts, MirroredEndsOfWhatDragsItselfTouchByThemselves) {
  Motion crawl = head_and_two_feet(0.013, 0);
  for (Eigen::Index f = 0; f < kFrames; ++f) crawl.at(f).col(1).x() += 0.02 * static_cast<double>(f < 30 ? f : 60 - f);
  const ContactSchedule alone = label_two_feet(crawl, {}), pair = label_two_feet(crawl, {{1, 2}});
  ASSERT_TRUE(is_dragged(alone));
  EXPECT_TRUE(pair.state == alone.state);
  EXPECT_EQ(pair.patches.size(), 1u) << "the higher one never touches";
}

TEST(LabelContacts, MirroredFeetThatTakeTurnsTouchByThemselves) {
  for (const Eigen::Index lag : {10, 15, 30, 45}) {
    SCOPED_TRACE("behind by " + std::to_string(lag));
    const Motion walk = head_and_two_feet(0.004, lag);
    const ContactSchedule alone = label_two_feet(walk, {}), pair = label_two_feet(walk, {{1, 2}});
    EXPECT_TRUE(pair.state == alone.state);
    EXPECT_FALSE(pair.state[0] == pair.state[1]);
  }
}

TEST(GroundHeight, IsTheLevelOfTheLowestPoints) {
  for (const double level : {-0.3, 0.0, 1.7}) {
    // On the ground for half of the time, and once below it by mistake.
    const Motion motion = head_and_foot([&](Eigen::Index f) { return Eigen::Vector2d(0, level + (f == 3 ? -0.05 : f < 30 ? 0 : 0.1)); });
    Motion higher = motion;
    for (Eigen::Index f = 0; f < kFrames; ++f) higher.at(f)(1, 0) = level + 0.5;
    EXPECT_NEAR(ground_height(higher), level, 1e-12);
  }
}

TEST(PointMotion, IsTheWeightedSumOfTheNodes) {
  physics::ContactPoints points;
  points.nodes.resize(4, 1);
  points.nodes << 0, 1, 2, 0;
  points.weights.resize(4, 1);
  points.weights << 0.5, 0.3, 0.2, 0;
  Motion motion = head_and_foot([](Eigen::Index f) { return Eigen::Vector2d(0.1, 0.01 * static_cast<double>(f)); });
  motion.travel << 1, 0, 2;
  motion.yaw = 0.3;
  const Motion carried = point_motion(points, motion);
  EXPECT_TRUE(carried.loop);
  EXPECT_EQ(carried.travel, motion.travel);
  EXPECT_EQ(carried.yaw, motion.yaw);
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const auto x = motion.at(f);
    EXPECT_LT((carried.at(f).col(0) - (0.5 * x.col(0) + 0.3 * x.col(1) + 0.2 * x.col(2))).norm(), 1e-15);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::contacts_test

#include "retarget/leaps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace hydrostat::retarget::leaps_test {
namespace {

using enum ContactState;
constexpr long kFrames = 30;

struct Leap {
  Motion points;
  ContactSchedule contacts;
  std::vector<std::vector<Hold>> holds;
};

/// Two feet of one point each, at 60 Hz. Foot k stands for `stances[k]` frames from `begin[k]` on, round the seam of a loop, which travels
/// by 1 m, evenly.
Leap leap(const long (&begin)[2], const long (&stances)[2], bool loop = true) {
  Leap result;
  Motion& points = result.points;
  points.rate_hz = 60;
  points.loop = loop;
  points.travel = Eigen::Vector3d(0, 0, 1);
  points.frames = Eigen::MatrixXd::Zero(6, kFrames);
  result.contacts.patches = {{"fore", {0}, true}, {"hind", {1}, true}};
  result.contacts.state.assign(2, std::vector<ContactState>(kFrames, kOff));
  result.contacts.sliding_x = result.contacts.sliding_z = Eigen::MatrixXd::Zero(2, kFrames);
  result.contacts.touching = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(2, kFrames, false);
  for (std::size_t k = 0; k < 2; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    for (long f = begin[k]; f < begin[k] + stances[k]; ++f) {
      result.contacts.state[k][static_cast<std::size_t>(f % kFrames)] = kStick;
      result.contacts.touching(row, f % kFrames) = true;
    }
    for (long f = 0; f < kFrames; ++f) {
      points.frames(3 * row, f) = static_cast<double>(k);
      points.frames(3 * row + 2, f) = static_cast<double>(f) / kFrames;
    }
  }
  result.holds = find_holds(result.contacts, points);
  return result;
}

TEST(FramesInFlight, AreThoseInWhichNothingTouchesForLong) {
  for (const long gap : {1L, 2L, 3L, 8L}) {  // 0.05 s are 3 frames
    SCOPED_TRACE("gap " + std::to_string(gap));
    const std::vector<bool> flying = frames_in_flight(leap({0, 0}, {kFrames - gap, kFrames - gap}).contacts, 60, true);
    EXPECT_EQ(std::count(flying.begin(), flying.end(), true), gap >= 3 ? gap : 0);
    EXPECT_EQ(flying.back(), gap >= 3);
  }
  const std::vector<bool> never_down = frames_in_flight(leap({0, 0}, {0, 0}, false).contacts, 60, false);
  EXPECT_EQ(std::count(never_down.begin(), never_down.end(), true), kFrames);
}

TEST(FramesInFlight, ALoopFliesOverItsSeam) {
  const std::vector<bool> flying = frames_in_flight(leap({2, 2}, {kFrames - 4, kFrames - 4}).contacts, 60, true);
  EXPECT_TRUE(flying[0] && flying[1] && flying[kFrames - 1] && flying[kFrames - 2]);
  EXPECT_EQ(std::count(flying.begin(), flying.end(), true), 4);
}

TEST(ProlongStances, EveryStanceLastsLongerAtBothEndsOnItsPlace) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto draw = [&](long from, long to) { return std::uniform_int_distribution<long>(from, to)(random); };
    const long longer = draw(1, 3), lasts[] = {draw(4, 20), draw(4, 20)}, begin[] = {draw(0, kFrames - 1), draw(0, kFrames - 1)};
    Leap after = leap(begin, lasts);
    const Leap before = after;
    prolong_stances(after.points, longer, after.contacts, after.holds);
    for (std::size_t k = 0; k < 2; ++k) {
      for (long f = 0; f < kFrames; ++f) {
        const auto frame = static_cast<std::size_t>(f);
        const long since = (f - begin[k] + kFrames) % kFrames;  // the stance's first frame is 0, those before it are at the period's end
        const ContactState wanted = since < lasts[k] + longer ? kStick : since >= kFrames - longer ? kSlide : kOff;
        EXPECT_EQ(after.contacts.state[k][frame], wanted) << k << " " << f;
        EXPECT_EQ(after.contacts.touching(static_cast<Eigen::Index>(k), f), wanted != kOff);
        const Eigen::Index row = static_cast<Eigen::Index>(k);
        if (wanted == kSlide) {
          EXPECT_EQ(Eigen::Vector2d(after.contacts.sliding_x(row, f), after.contacts.sliding_z(row, f)), Eigen::Vector2d(0, 1));
        }
        const auto is_own = [&](const Hold& h) { return h.point == static_cast<int>(k); };
        ASSERT_EQ(std::count_if(after.holds[frame].begin(), after.holds[frame].end(), is_own), wanted != kOff);
        if (wanted == kOff || before.contacts.state[k][frame] == kStick) continue;
        // The place of the stance's nearest frame, of the period before or after where the seam lies between.
        const long nearest = since < lasts[k] + longer ? begin[k] + lasts[k] - 1 : begin[k];
        const std::vector<Hold>& stood = before.holds[static_cast<std::size_t>(nearest % kFrames)];
        const double travelled = f - nearest % kFrames > kFrames / 2 ? 1 : (nearest % kFrames - f > kFrames / 2 ? -1 : 0);
        const Eigen::Vector3d moved = std::find_if(after.holds[frame].begin(), after.holds[frame].end(), is_own)->place - std::find_if(stood.begin(), stood.end(), is_own)->place;
        EXPECT_LT((moved - Eigen::Vector3d(0, 0, travelled)).norm(), 1e-12) << k << " " << f;
      }
    }
  }
}

TEST(ProlongStances, WhatLandsIsNotDragged) {
  Leap after = leap({4, 8}, {12, 12});
  prolong_stances(after.points, 1, after.contacts, after.holds);
  ASSERT_EQ(after.contacts.state[0][3], kSlide);
  EXPECT_FALSE(is_dragged(after.contacts));
  after.contacts.state[0][2] = kSlide;
  EXPECT_TRUE(is_dragged(after.contacts));
}

TEST(ProlongStances, OfWhatIsPlayedOnceStayInsideTheClip) {
  Leap after = leap({0, 20}, {10, 10}, false);
  prolong_stances(after.points, 2, after.contacts, after.holds);
  const auto frames_of = [&](std::size_t k) { return kFrames - std::count(after.contacts.state[k].begin(), after.contacts.state[k].end(), kOff); };
  EXPECT_EQ(frames_of(0), 12);
  EXPECT_EQ(frames_of(1), 12);
}

TEST(StepsNext, AFootThatFliesFirstIsNone) {
  // The first foot leaves in frame 10, the second in 14; both land at the loop's seam.
  const std::vector<std::vector<bool>> steps = steps_next(leap({0, 0}, {10, 14}).contacts, 60, true);
  for (long f = 0; f < kFrames; ++f) {
    EXPECT_EQ(steps[0][static_cast<std::size_t>(f)], f < 10) << f;
    EXPECT_EQ(steps[1][static_cast<std::size_t>(f)], f < 14) << f;
  }
  // After the landing the second foot is still to come.
  const std::vector<std::vector<bool>> last = steps_next(leap({0, 4}, {20, 16}).contacts, 60, true);
  for (long f = 0; f < 4; ++f) EXPECT_TRUE(last[1][static_cast<std::size_t>(f)]) << f;
  EXPECT_FALSE(last[1][25]);
}

TEST(StepsNext, WhoNeverFliesStepsAlways) {
  for (const std::vector<bool>& foot : steps_next(leap({0, 15}, {15, 15}).contacts, 60, true)) {
    EXPECT_EQ(std::count(foot.begin(), foot.end(), true), kFrames);
  }
}

TEST(GainOfLeaps, IsTheUsualOfWhatNeverFlies) {
  CorrectorOptions usual;
  const auto gain_of = [&](const Leap& leap) { return gain_of_leaps({leap.points, leap.contacts, {}, {}, {}, {}}, usual); };
  const CorrectorOptions walk = gain_of(leap({0, 15}, {15, 15})), hops = gain_of(leap({0, 0}, {15, 15}));
  EXPECT_EQ(walk.foot_weight, usual.foot_weight);
  EXPECT_EQ(walk.root_weight, usual.root_weight);
  EXPECT_LT(hops.foot_weight, usual.foot_weight);
  EXPECT_LT(hops.root_weight, usual.root_weight);
  EXPECT_GT(hops.effort, usual.effort) << "a hop that keeps itself up is not to be shaken";
  EXPECT_EQ(walk.effort, usual.effort);
  EXPECT_GT(hops.node_weight, usual.node_weight);
  EXPECT_EQ(walk.node_weight, usual.node_weight);
  EXPECT_GT(hops.horizon_s, usual.horizon_s);
  EXPECT_EQ(walk.horizon_s, usual.horizon_s);
  EXPECT_TRUE(std::isinf(hops.long_step)) << "the next hop makes up for it";
  EXPECT_EQ(walk.long_step, usual.long_step);
  const CorrectorOptions jump = gain_of(leap({20, 20}, {10, 10}, false));
  EXPECT_LT(jump.foot_weight, usual.foot_weight);
  EXPECT_EQ(jump.root_weight, usual.root_weight) << "it has to stand where it lands";
  EXPECT_EQ(jump.effort, usual.effort);
  EXPECT_EQ(jump.node_weight, usual.node_weight);
  EXPECT_GT(jump.horizon_s, usual.horizon_s);
  EXPECT_LT(jump.settle_s, usual.settle_s) << "while its feet still give";
  EXPECT_EQ(hops.settle_s, usual.settle_s);
  EXPECT_EQ(jump.long_step, usual.long_step);
}

}  // namespace
}  // namespace hydrostat::retarget::leaps_test

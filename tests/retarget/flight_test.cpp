#include "retarget/flight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hydrostat::retarget::flight_test {
namespace {

constexpr double kGravity = 9.81;

struct Jump {
  Motion motion;
  ContactSchedule contacts;
  Eigen::Matrix3Xd com;
};

/// Stands but for the frames start + 1 to end - 1 (which may lie beyond the end of a loop); there it rises by `rise` [m] on a parabola.
Jump jump(Eigen::Index frames, Eigen::Index start, Eigen::Index end, double rise, bool loop) {
  Jump made;
  made.motion.loop = loop;
  made.motion.frames = Eigen::MatrixXd::Zero(3, frames);
  made.contacts.touching.setConstant(2, frames, true);
  made.com = Eigen::Matrix3Xd::Zero(3, frames);
  made.com.row(1).setConstant(0.5);
  for (Eigen::Index f = start + 1; f < end; ++f) {
    const double part = static_cast<double>(f - start) / static_cast<double>(end - start);
    made.contacts.touching.col(f % frames).setConstant(false);
    made.com(1, f % frames) += 4 * rise * part * (1 - part);
  }
  return made;
}

std::vector<Flight> flights_of(const Jump& made) { return flights(made.contacts, made.motion, made.com, kGravity); }

TEST(Flights, ABodyThatFallsFreelyRisesAsItsTimeAsks) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Eigen::Index start = 3 + static_cast<Eigen::Index>(random() % 10), even = 2 * (2 + static_cast<Eigen::Index>(random() % 12));
    const double seconds = static_cast<double>(even) / 60, rise = kGravity * seconds * seconds / 8;
    const auto found = flights_of(jump(60, start, start + even, rise, false));
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].start, start);
    EXPECT_EQ(found[0].end, start + even);
    EXPECT_NEAR(found[0].rise_m, rise, 1e-12);
    EXPECT_NEAR(found[0].free_fall_m, rise, 1e-12);
    EXPECT_TRUE(flight_warnings(found, 60, 1, 0.01).empty());
  }
}

TEST(Flights, GoOnIntoTheNextPeriodOfALoop) {
  const auto found = flights_of(jump(60, 50, 70, 0.2, true));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].start, 50);
  EXPECT_EQ(found[0].end, 70);
  EXPECT_NEAR(found[0].rise_m, 0.2, 1e-12);
}

TEST(Flights, AreNoneWhereNothingLandsOrNothingTouches) {
  EXPECT_TRUE(flights_of(jump(60, 50, 70, 0, false)).empty()) << "it stands at frame 0 and leaves for good";
  Jump never = jump(60, 10, 20, 0.1, true);
  never.contacts.touching.setConstant(false);
  EXPECT_TRUE(flights_of(never).empty());
  EXPECT_TRUE(flights_of(jump(60, 10, 10, 0, true)).empty());
}

TEST(Flights, AreMeasuredOverTheLineFromTakeOffToLanding) {
  Jump made = jump(60, 10, 30, 0.1, false);
  for (Eigen::Index f = 0; f < 60; ++f) made.com(1, f) += 0.02 * static_cast<double>(f);  // onto a roof
  EXPECT_NEAR(flights_of(made)[0].rise_m, 0.1, 1e-12);
}

TEST(FlightWarnings, NameTheHeightAtWhichTimeAndRiseAgree) {
  const Jump made = jump(60, 10, 30, 1.0, false);  // 1/3 s: free fall rises 0.136 m
  const auto warnings = flight_warnings(flights_of(made), 60, 2, 3);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0],
            "the clip is in the air for 0.33 s (frames 10 to 30, 0.167 s on) and rises by 1 m; free fall of that time rises by 0.136 m, "
            "and so will the creature: give --height 0.27, where time and rise agree, or let the flight last 0.90 s");
  // The mend mends: everything at that height is smaller by the same factor, the time is not.
  Jump mended = made;
  mended.com *= 0.27 / 2;
  EXPECT_TRUE(flight_warnings(flights_of(mended), 60, 0.27, 3 * 0.27 / 2).empty());
}

TEST(FlightWarnings, TellWhatFloats) {
  const auto warnings = flight_warnings(flights_of(jump(90, 10, 70, 0, false)), 60, 1, 1);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("it floats; put a foot on the ground there"), std::string::npos) << warnings[0];
  EXPECT_TRUE(flight_warnings(flights_of(jump(90, 10, 14, 0, false)), 60, 1, 1).empty()) << "too short to matter";
  EXPECT_TRUE(flight_warnings({}, 60, 1, 1).empty());
}

TEST(FlightWarnings, AreOfTheWorst) {
  Jump made = jump(120, 10, 30, 0.14, false);
  const Jump other = jump(120, 60, 80, 0.7, false);
  made.com.row(1) += other.com.row(1);
  made.contacts.touching = made.contacts.touching && other.contacts.touching;
  const auto warnings = flight_warnings(flights_of(made), 60, 1, 1);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("frames 60 to 80"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace hydrostat::retarget::flight_test

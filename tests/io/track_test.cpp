#include "io/track.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "retarget/error.h"

namespace hydrostat::io::track_test {
namespace {

Track random_track(unsigned seed, Eigen::Index rows, Interpolation interpolation) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1), gap(0.01, 0.5);
  const Eigen::Index keys = 2 + static_cast<Eigen::Index>(random() % 6);
  const auto draw = [&] { return number(random); };
  Track track;
  track.interpolation = interpolation;
  for (Eigen::Index k = 0; k < keys; ++k) track.times.push_back((k == 0 ? 0 : track.times.back()) + gap(random));
  track.values = Eigen::MatrixXd::NullaryExpr(rows, keys, draw);
  if (interpolation == Interpolation::kCubic) {
    track.in_tangents = Eigen::MatrixXd::NullaryExpr(rows, keys, draw);
    track.out_tangents = Eigen::MatrixXd::NullaryExpr(rows, keys, draw);
  }
  make_sound(track, "file", "track");
  return track;
}

TEST(ValueAt, GoesThroughTheKeysAndHoldsBeyondThem) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const Interpolation way : {Interpolation::kStep, Interpolation::kLinear, Interpolation::kCubic}) {
      for (const Eigen::Index rows : {3, 4}) {
        const Track track = random_track(seed, rows, way);
        for (std::size_t k = 0; k < track.times.size(); ++k) {
          EXPECT_LT((value_at(track, track.times[k]) - track.values.col(static_cast<Eigen::Index>(k))).norm(), 1e-12);
        }
        EXPECT_EQ(value_at(track, track.times.front() - 1), track.values.col(0));
        EXPECT_EQ(value_at(track, track.times.back() + 1), track.values.rightCols(1));
      }
    }
  }
}

TEST(ValueAt, CubicKeysHaveTheSlopeOfTheirTangents) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Track track = random_track(seed, 3, Interpolation::kCubic);
    const double step = 1e-8, key = track.times[0], last = track.times[1];
    EXPECT_LT(((value_at(track, key + step) - value_at(track, key)) / step - track.out_tangents.col(0)).norm(), 1e-3);
    EXPECT_LT(((value_at(track, last) - value_at(track, last - step)) / step - track.in_tangents.col(1)).norm(), 1e-3);
  }
}

TEST(ValueAt, RotationsStayUnitAndTakeTheShortWay) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Track track = random_track(seed, 4, Interpolation::kLinear);
    for (Eigen::Index k = 0; k + 1 < track.values.cols(); ++k) {
      EXPECT_GE(track.values.col(k).dot(track.values.col(k + 1)), 0);
      const double from = track.times[static_cast<std::size_t>(k)], to = track.times[static_cast<std::size_t>(k) + 1];
      const Eigen::VectorXd middle = value_at(track, (from + to) / 2);
      EXPECT_NEAR(middle.norm(), 1, 1e-12);
      EXPECT_NEAR(middle.dot(track.values.col(k)), middle.dot(track.values.col(k + 1)), 1e-9);
    }
  }
}

TEST(MakeSound, OfTwoKeysAtOneTimeTheLaterStays) {
  Track track;
  track.times = {0, 1, 1, 2};
  track.values = Eigen::MatrixXd::Zero(3, 4);
  track.values.row(0) << 0, 1, 5, 6;
  make_sound(track, "file", "track");
  EXPECT_EQ(track.times, (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(track.values.row(0), Eigen::RowVector3d(0, 5, 6));
}

TEST(MakeSound, RefusesWhatIsNoMotion) {
  Track track;
  track.times = {0, 1};
  track.values = Eigen::MatrixXd::Ones(4, 2);
  Track descending = track, zero = track, infinite = track;
  descending.times = {1, 0};
  zero.values.col(1).setZero();
  infinite.values(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_NO_THROW(make_sound(track, "file", "track"));
  EXPECT_THROW(make_sound(descending, "file", "track"), Error);
  EXPECT_THROW(make_sound(zero, "file", "track"), Error);
  EXPECT_THROW(make_sound(infinite, "file", "track"), Error);
}

}  // namespace
}  // namespace hydrostat::io::track_test

#include "retarget/mirror.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace hydrostat::retarget::mirror_test {
namespace {

constexpr int kFeet = 4, kPerBone = 12;
constexpr Eigen::Index kFrames = 40;

struct Points {
  Eigen::Matrix3Xd rest;  // [m], of an animal one metre long
  std::vector<int> bone_of_point;
};

/// Feet 0 to 3, left and right in front, left and right behind, and a head, bone 4, before them in the middle; z is along, or x where
/// `is_turned`. Each point is up to `noise` [m] off along each axis.
Points four_legger(std::mt19937& random, double noise, bool is_turned) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Points points;
  points.rest.resize(3, (kFeet + 1) * kPerBone);
  for (int k = 0; k < kPerBone; ++k) {
    const Eigen::Vector3d scatter = 0.04 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    for (int bone = 0; bone <= kFeet; ++bone) {
      const double side = bone % 2 == 0 ? 1 : -1, left = bone == kFeet ? (k % 2 == 0 ? 1 : -1) : side;
      Eigen::Vector3d place(0.15 * side, 0, bone < 2 ? 0.3 : -0.35);
      if (bone == kFeet) place << 0, 0.3, 0.6;
      const Eigen::Vector3d own(left * scatter.x(), scatter.y(), scatter.z());
      points.rest.col(bone * kPerBone + k) = place + own + noise * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    }
  }
  for (int bone = 0; bone <= kFeet; ++bone) points.bone_of_point.insert(points.bone_of_point.end(), kPerBone, bone);
  if (is_turned) points.rest.row(0).swap(points.rest.row(2));
  return points;
}

TEST(MirroredBones, AreLeftAndRight) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const bool is_turned : {false, true}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + (is_turned ? ", turned" : ""));
      std::mt19937 random(seed);
      const Points points = four_legger(random, 0.02, is_turned);
      const std::vector<std::array<int, 2>> pairs = mirrored_bones(points.rest, points.bone_of_point, 1);
      EXPECT_EQ(pairs, (std::vector<std::array<int, 2>>{{0, 1}, {2, 3}}));
    }
  }
}

TEST(MirroredBones, AreNoneWhereOneLegStandsElsewhere) {
  std::mt19937 random(1);
  Points points = four_legger(random, 0, false);
  points.rest.block(2, 3 * kPerBone, 1, kPerBone).array() += 0.1;
  const std::vector<std::array<int, 2>> pairs = mirrored_bones(points.rest, points.bone_of_point, 1);
  EXPECT_EQ(pairs, (std::vector<std::array<int, 2>>{{0, 1}}));
}

/// Each foot swings along the body's length, the right ones `lag` of a period behind; the body goes on along `travel`.
Motion stepping(const Points& points, double lag, const Eigen::Vector3d& travel, int along) {
  Motion motion;
  motion.loop = true;
  motion.travel = travel;
  motion.frames.resize(points.rest.size(), kFrames);
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const double phase = static_cast<double>(f) / static_cast<double>(kFrames);
    for (Eigen::Index p = 0; p < points.rest.cols(); ++p) {
      const int bone = points.bone_of_point[static_cast<std::size_t>(p)];
      Eigen::Vector3d swing = Eigen::Vector3d::Zero();
      if (bone < kFeet) swing[along] = 0.1 * std::sin(2 * M_PI * (phase - (bone % 2) * lag));
      motion.at(f).col(p) = points.rest.col(p) + swing + phase * travel;
    }
  }
  return motion;
}

TEST(MirrorAxis, IsThatOfWhatHopsAndNoneOfWhatSteps) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    for (const bool is_turned : {false, true}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + (is_turned ? ", turned" : ""));
      std::mt19937 random(seed);
      const Points points = four_legger(random, 0.005, is_turned);
      const int across = is_turned ? 2 : 0, along = 2 - across;
      for (const Eigen::Vector3d& travel : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.7, 0, 0.4)}) {
        EXPECT_EQ(mirror_axis(stepping(points, 0, travel, along), 1), across);
        EXPECT_EQ(mirror_axis(stepping(points, 0.5, travel, along), 1), std::nullopt);
      }
    }
  }
}

TEST(MirrorAxis, OfManyPointsIsThatOfAFew) {
  constexpr int kHeads = 2000 / kPerBone;  // before all others: by the first thousand points nothing steps
  std::mt19937 random(1);
  Points points = four_legger(random, 0, false);
  const Eigen::Matrix3Xd head = points.rest.rightCols(kPerBone), body = points.rest;
  points.rest.resize(3, kHeads * kPerBone + body.cols());
  points.rest << head.replicate(1, kHeads), body;
  points.bone_of_point.insert(points.bone_of_point.begin(), kHeads * kPerBone, kFeet);
  EXPECT_EQ(mirror_axis(stepping(points, 0, {0, 0, 0.5}, 2), 1), 0);
  EXPECT_EQ(mirror_axis(stepping(points, 0.5, {0, 0, 0.5}, 2), 1), std::nullopt);
}

}  // namespace
}  // namespace hydrostat::retarget::mirror_test

#include "retarget/rest_lengths.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "retarget/inverse_dynamics.h"
#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::rest_lengths_test {
namespace {

constexpr Eigen::Index kFrames = 24;

/// Shares of the box, drawn within `most` [-] of 1 along each axis, that come and go over the loop from the rest shape.
Motion swelling(const BoxCreature& creature, unsigned seed, double most) {
  std::mt19937 random(seed);
  Eigen::Vector3d share;
  for (double& s : share) s = most * (static_cast<double>(random()) / 2147483647.5 - 1);
  Motion motion = standing(creature, kFrames);
  motion.loop = true;
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const double phase = 0.5 - 0.5 * std::cos(2 * M_PI * static_cast<double>(f) / kFrames);
    const Eigen::Matrix3d deform = (Eigen::Vector3d::Ones() + phase * share).asDiagonal();
    motion.at(f) = deform * creature.scene.body.rest;
  }
  return motion;
}

/// Least and most of a constraint's lengths in a motion [m].
std::pair<double, double> range_of(const physics::Body& body, const Motion& motion, int edge) {
  double least = 1e9, most = 0;
  for (Eigen::Index f = 0; f < motion.count(); ++f) {
    const Eigen::Matrix3Xd x = motion.at(f);
    const double length = (x.col(body.edges(1, edge)) - x.col(body.edges(0, edge))).norm();
    least = std::min(least, length);
    most = std::max(most, length);
  }
  return {least, most};
}

TEST(RestLengths, ChangeForWhatIsTakenTooFarAloneAndThenToTheMiddle) {
  const BoxCreature creature = make_box_creature();
  int kept = 0, changed = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    const Motion motion = swelling(creature, seed, 0.9);
    physics::Body body = creature.scene.body;
    fit_rest_lengths(motion, body);
    int of_seed = 0;
    for (int e = 0; e < body.edge_count(); ++e) {
      const auto [least, most] = range_of(creature.scene.body, motion, e);
      const double usual = creature.scene.body.rest_length[e];
      if (most <= 1.4 * usual && least >= 0.6 * usual) {
        EXPECT_EQ(body.rest_length[e], usual) << "seed " << seed << ", constraint " << e;
        ++kept;
      } else {
        EXPECT_NEAR(body.rest_length[e] - least, most - body.rest_length[e], 1e-12) << "seed " << seed << ", constraint " << e;
        ++of_seed;
      }
    }
    changed += of_seed;
    EXPECT_DOUBLE_EQ(share_overstrained(motion, creature.scene.body), static_cast<double>(of_seed) / body.edge_count());
    EXPECT_EQ(has_fitted_rest_lengths(body), of_seed > 0);
    EXPECT_EQ(body.edge_stiffness, creature.scene.body.edge_stiffness);
    EXPECT_EQ(body.rest, creature.scene.body.rest);
  }
  EXPECT_GT(kept, 100);
  EXPECT_GT(changed, 100);
}

TEST(RestLengths, OfFiniteElementsStay) {
  const BoxCreature springs = make_box_creature();
  const Motion motion = swelling(springs, 1, 0.9);
  physics::Body body = springs.scene.body;
  ASSERT_GT(share_overstrained(motion, body), 0);
  body.elements.emplace_back();  // whatever they are of
  const Eigen::VectorXd before = body.rest_length;
  fit_rest_lengths(motion, body);
  EXPECT_EQ(body.rest_length, before);
  EXPECT_EQ(share_overstrained(motion, body), 0);
}

/// What is bound folded: a box that the motion pulls out to 2.2 times its length and back, of the same volume.
Motion unfolding(const BoxCreature& creature) {
  Motion motion = swelling(creature, 0, 0);
  motion.rate_hz = 15;
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    const double longer = 1 + 1.2 * (0.5 - 0.5 * std::cos(2 * M_PI * static_cast<double>(f) / kFrames));
    const Eigen::Matrix3d deform = Eigen::Vector3d(1 / std::sqrt(longer), longer, 1 / std::sqrt(longer)).asDiagonal();
    motion.at(f) = deform * creature.scene.body.rest;
  }
  return motion;
}

TEST(RestLengths, InTheMiddleLeaveMusclesRoomToFollowWhatUnfolds) {
  BoxCreature creature = make_box_creature();
  creature.scene.gravity.setZero();
  const Motion motion = unfolding(creature);
  ContactSchedule afloat = always_standing(creature, motion.count());
  afloat.touching.setConstant(false);
  const PreparedTarget prepared = as_prepared(motion, afloat);
  const InverseDynamics bound = solve_within_automatic_limit(prepared, creature.scene, BoxCreature::kLength, {});
  fit_rest_lengths(motion, creature.scene.body);
  const InverseDynamics fitted = solve_within_automatic_limit(prepared, creature.scene, BoxCreature::kLength, {});
  EXPECT_GT(bound.report.saturated, 0.1);
  EXPECT_LT(fitted.report.saturated, 0.25 * bound.report.saturated);
  EXPECT_LT(fitted.report.miss_rms_length, 0.5 * bound.report.miss_rms_length);
}

}  // namespace
}  // namespace hydrostat::retarget::rest_lengths_test

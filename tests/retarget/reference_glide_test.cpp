#include "retarget/reference_glide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::reference_glide_test {
namespace {

/// The body stands at `offset` from the target and is turned by `yaw`.
RigidFit fit_of(const Eigen::Vector3d& offset, double yaw) {
  const Eigen::Vector3d target(0.3, 0.4, -0.2);
  return {Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix(), target, target + offset, 0};
}

double level_distance(const Eigen::Vector3d& offset, const ReferenceGlide& glide) {
  return std::hypot(offset.x() - glide.x, offset.z() - glide.z);
}

TEST(ReferenceGlide, LeavesSmallErrorsToTheCorrector) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<> draw(-1, 1);
    ReferenceGlide glide = make_glide(1, 0.3, 1);
    const Eigen::Vector3d offset(0.7 * glide.reach * draw(random), draw(random), 0.7 * glide.reach * draw(random));
    glide.follow(fit_of(offset, 0.99 * glide.turn_reach * draw(random)), 1.0 / 120);
    EXPECT_EQ(glide.x, 0);
    EXPECT_EQ(glide.z, 0);
    EXPECT_EQ(glide.yaw, 0);
  }
}

TEST(ReferenceGlide, IsNeverFurtherFromTheBodyThanItsReach) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<> draw(-2, 2);
    ReferenceGlide glide = make_glide(1, 0.3, 1);
    const Eigen::Vector3d offset(draw(random), draw(random), draw(random));
    const double yaw = draw(random);
    glide.follow(fit_of(offset, yaw), /*seconds=*/0);
    EXPECT_LE(level_distance(offset, glide), glide.reach + 1e-12);
    EXPECT_LE(std::abs(std::remainder(yaw - glide.yaw, 2 * M_PI)), glide.turn_reach + 1e-12);
  }
}

TEST(ReferenceGlide, GivesWayAtOnceWhereThePlanDragsTheBody) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = bobbing(creature, 20, 0.3);
  PreparedTarget plan = as_prepared(motion, always_standing(creature, motion.count()));
  const ReferenceGlide stands = glide_for(plan, 0.3, 1);
  plan.contacts.state[0][7] = plan.contacts.state[0][8] = ContactState::kSlide;  // two frames of one patch
  const ReferenceGlide dragged = glide_for(plan, 0.3, 1);
  EXPECT_EQ(dragged.reach, make_glide(0, 0.3, 1).reach);
  EXPECT_GT(stands.reach, 2 * dragged.reach);
}

TEST(ReferenceGlide, ComesBackWhenTheBodyDoes) {
  ReferenceGlide glide = make_glide(1, 0.3, 1);
  glide.follow(fit_of({0.5, 0, -0.3}, 1), 1.0 / 120);
  for (int k = 0; k < 120 * 20; ++k) glide.follow(fit_of({glide.x, 0, glide.z}, glide.yaw), 1.0 / 120);
  EXPECT_LT(std::hypot(glide.x, glide.z), 0.01);
  EXPECT_LT(std::abs(glide.yaw), 0.01);
}

TEST(ReferenceGlide, MovesTheReferenceRigidlyOverTheGround) {
  std::mt19937 random(3);
  std::normal_distribution<> normal;
  const auto draw = [&] { return normal(random); };
  physics::State reference{Eigen::Matrix3Xd::NullaryExpr(3, 10, draw), Eigen::Matrix3Xd::NullaryExpr(3, 10, draw)};
  const physics::State before = reference;
  const Eigen::Vector3d com = before.x.rowwise().mean();
  const ReferenceGlide glide{0.1, 0.1, 0.4, -0.2, 0.7};
  glide.apply(com, reference);
  EXPECT_LT((reference.x.rowwise().mean() - com - Eigen::Vector3d(0.4, 0, -0.2)).norm(), 1e-12);
  EXPECT_TRUE(reference.x.row(1).isApprox(before.x.row(1), 1e-12));
  EXPECT_TRUE(reference.v.colwise().norm().isApprox(before.v.colwise().norm(), 1e-12));
  EXPECT_NEAR((reference.x.col(3) - reference.x.col(7)).norm(), (before.x.col(3) - before.x.col(7)).norm(), 1e-12);
}

TEST(ReferenceGlide, ASlowCreatureIsNotAskedToCatchUpFast) {
  double before = 0;
  for (const double speed : {0.0, 0.2, 0.4, 0.8}) {
    const ReferenceGlide glide = make_glide(speed, 0.3, 1);
    EXPECT_GE(glide.reach, before);
    EXPECT_GT(glide.reach, 0);
    before = glide.reach;
  }
  EXPECT_EQ(make_glide(100, 0.3, 1).reach, make_glide(1000, 0.3, 1).reach);
  EXPECT_NEAR(make_glide(2, 0.3, 2).reach, 2 * make_glide(1, 0.3, 1).reach, 1e-12);  // a body twice as large
}

TEST(YawOf, IsTheTurnAboutTheVertical) {
  for (double yaw = -3; yaw <= 3; yaw += 0.25) {
    EXPECT_NEAR(yaw_of(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix()), yaw, 1e-12);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::reference_glide_test

#include "retarget/firm_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::firm_plan_test {
namespace {

constexpr Eigen::Index kFrames = 40, kHighest = 20;
constexpr double kFirm = 10;

/// The box stands on three legs and folds the fourth, whose sole rises by `lift` [m] until kHighest.
Motion lifting(const BoxCreature& creature, int leg, double lift) {
  return played(creature, kFrames, true, [&, leg, lift](const Eigen::Vector3d& x, Eigen::Index f) {
    const int its = 1 + (x.x() > 0.25 ? 2 : 0) + (x.z() > 0.2 ? 1 : 0);
    if (its != leg || x.y() > 0.05 || std::abs(f - kHighest) >= 10) return x;
    return Eigen::Vector3d(x + Eigen::Vector3d(0, lift * std::pow(std::cos(M_PI * static_cast<double>(f - kHighest) / 20), 2), 0));
  });
}

/// Height [m] of that leg's sole when the clip has it highest.
double rise(const BoxCreature& creature, const PreparedTarget& plan, int leg) {
  const Eigen::Matrix3Xd points = point_motion(creature.scene.contact_points, plan.target).at(kHighest);
  double sum = 0, count = 0;
  for (std::size_t p = 0; p < creature.patch_bone.size(); ++p) {
    if (creature.patch_bone[p] == leg) sum += points(1, static_cast<Eigen::Index>(p)), ++count;
  }
  return sum / count;
}

PreparedTarget with_firmness(double firmness, const BoxCreature& creature, const Motion& motion) {
  PrepareOptions options;
  options.firmness = firmness;
  return prepared(creature, motion, options);
}

TEST(FirmPlan, LiftsAFoldedLegNearerToTheClip) {
  const BoxCreature creature = make_box_creature();
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 generator(seed);
    const int leg = 1 + static_cast<int>(generator() % 4);
    const double lift = 0.02 + 0.02 * generator() / 4294967296.0;
    const Motion motion = lifting(creature, leg, lift);
    const PreparedTarget loose = with_firmness(1, creature, motion), firm = with_firmness(kFirm, creature, motion);
    EXPECT_EQ(firm.firmness, kFirm);
    // Measured: 0.68 to 0.77; the smoothing of the clip takes its share of both.
    EXPECT_LT(lift - rise(creature, firm, leg), 0.85 * (lift - rise(creature, loose, leg)));
    EXPECT_LT(rise(creature, firm, leg), lift);
  }
}

TEST(FirmPlan, IsCorrectedByFeetThatAreThereSooner) {
  PreparedTarget plan;
  const CorrectorOptions usual;
  double settle = usual.foot_settle_s, step = usual.step;
  for (const double firmness : {1.0, 2.0, 5.0, kFirm, 50.0}) {
    SCOPED_TRACE(firmness);
    plan.firmness = firmness;
    const CorrectorOptions gain = gain_of_firm_plan(plan, usual);
    const bool is_between = firmness > 1 && firmness <= kFirm;
    EXPECT_EQ(gain.foot_settle_s < settle, is_between);
    EXPECT_EQ(gain.step > step, is_between);
    EXPECT_EQ(gain.effort, usual.effort);
    settle = gain.foot_settle_s, step = gain.step;
  }
  EXPECT_NEAR(settle, usual.foot_settle_s / 2, 1e-12);
}

}  // namespace
}  // namespace hydrostat::retarget::firm_plan_test

#include "retarget/balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget {
namespace {

TEST(ContactGenerators, StayInsideTheConeAndOpposeTheSliding) {
  const BoxCreature creature = make_box_creature();
  ContactSchedule contacts = always_standing(creature, 3);
  contacts.state[1][1] = ContactState::kOff;
  contacts.state[2][1] = ContactState::kSlide;
  contacts.sliding_x(2, 1) = 0.6;
  contacts.sliding_z(2, 1) = -0.8;
  contacts.touching(0, 1) = false;
  std::vector<int> seen(static_cast<std::size_t>(creature.scene.contact_points.count()), 0);
  for (const ContactGenerator& g : contact_generators(contacts, 1, 0.7, 0.9)) {
    ++seen[static_cast<std::size_t>(g.point)];
    EXPECT_EQ(g.force.y(), 1);
    const bool slides = creature.patch_bone[static_cast<std::size_t>(g.point)] == 3;
    if (slides) {
      EXPECT_LT((g.force - Eigen::Vector3d(-0.7 * 0.6, 1, 0.7 * 0.8)).norm(), 1e-15);
    }
    if (!slides) {
      EXPECT_NEAR(std::hypot(g.force.x(), g.force.z()), 0.63, 1e-15);
    }
  }
  for (std::size_t p = 0; p < seen.size(); ++p) {
    const int bone = creature.patch_bone[p];
    EXPECT_EQ(seen[p], p == 0 || bone == 2 ? 0 : bone == 3 ? 1 : 4) << "point " << p;
  }
}

TEST(ContactGenerators, LeaveToTheSidesWhatSlidingDoesNotSettle) {
  const BoxCreature creature = make_box_creature();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    ContactSchedule contacts = always_standing(creature, 1);
    Eigen::Vector2d settled(uniform(random), uniform(random));
    settled *= std::abs(uniform(random)) / settled.norm();
    contacts.state[2][0] = ContactState::kSlide;
    contacts.sliding_x(2, 0) = settled.x();
    contacts.sliding_z(2, 0) = settled.y();
    for (const ContactGenerator& g : contact_generators(contacts, 0, 0.7, 0.9)) {
      if (creature.patch_bone[static_cast<std::size_t>(g.point)] != 3) continue;
      const Eigen::Vector2d sideways(g.force.x(), g.force.z());
      EXPECT_LE(sideways.norm(), 0.7 + 1e-12) << "outside Coulomb's cone";
      EXPECT_NEAR((sideways + 0.7 * settled).norm(), 0.7 * 0.9 * (1 - settled.norm()), 1e-12);
    }
  }
}

TEST(MissingWrench, IsNothingForABodyThatStands) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = standing(creature, 5);
  const Eigen::MatrixXd missing = missing_wrench(motion, creature.scene, always_standing(creature, 5), 1, 0.7);
  EXPECT_LT(missing.norm(), 1e-3);
}

TEST(MissingWrench, IsTheWeightOfABodyWithoutContact) {
  const BoxCreature creature = make_box_creature();
  ContactSchedule contacts = always_standing(creature, 5);
  for (std::vector<ContactState>& states : contacts.state) states.assign(5, ContactState::kOff);
  contacts.touching.setConstant(false);
  const Eigen::MatrixXd missing = missing_wrench(standing(creature, 5), creature.scene, contacts, 1, 0.7);
  for (Eigen::Index f = 0; f < 5; ++f) EXPECT_LT((missing.col(f).head<3>() - Eigen::Vector3d(0, 1, 0)).norm(), 1e-9);
}

TEST(FindShift, LeavesABalancedBodyWhereItIs) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = standing(creature, 12);
  const Shift shift = find_shift(motion, creature.scene, always_standing(creature, 12), 1, 0.7);
  EXPECT_TRUE(shift.converged);
  EXPECT_LT(shift.move.norm(), 1e-3);
  EXPECT_LT(shift.badness, 1e-3);
}

}  // namespace
}  // namespace hydrostat::retarget

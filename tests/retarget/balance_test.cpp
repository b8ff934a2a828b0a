#include "retarget/balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::balance_test {
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

/// What lies above the soles goes with a shift; they stay.
Motion leaned(const BoxCreature& creature, const Motion& motion, const Shift& shift) {
  Motion result = shifted(motion, shift, creature.scene.body);
  for (int i = 0; i < creature.scene.body.node_count(); ++i) {
    if (creature.scene.body.rest(1, i) < 0.05) result.frames.middleRows<3>(3 * i) = motion.frames.middleRows<3>(3 * i);
  }
  return result;
}

TEST(FindShift, CountsWhatWasShiftedBefore) {
  // On its right feet alone a box leans over them. Once it does nothing more is to be won, but if what it has leaned is forgotten it goes
  // on leaning, for that spreads the load.
  const BoxCreature creature = make_box_creature();
  for (const Eigen::Index frames : {12, 18, 24}) {
    SCOPED_TRACE(std::to_string(frames) + " frames");
    ContactSchedule contacts = always_standing(creature, frames);
    for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
      if (contacts.patches[k].name.find("left") == std::string::npos) continue;
      contacts.state[k].assign(static_cast<std::size_t>(frames), ContactState::kOff);
      for (const int p : contacts.patches[k].points) contacts.touching.row(p).setConstant(false);
    }
    Motion motion = standing(creature, frames);
    Shift so_far;
    for (int round = 0; round < 6; ++round) {
      const Shift shift = find_shift(motion, creature.scene, contacts, 1, 0.7, 60, {}, so_far);
      add(shift, so_far);
      motion = leaned(creature, motion, shift);
    }
    const Shift counted = find_shift(motion, creature.scene, contacts, 1, 0.7, 60, {}, so_far);
    const Shift forgotten = find_shift(motion, creature.scene, contacts, 1, 0.7);
    EXPECT_GT(so_far.move.norm(), 0.1);
    EXPECT_LT(counted.move.norm(), 0.1 * forgotten.move.norm());
  }
}

TEST(FindShift, MovesTheLoadToTheEndThatMustHold) {
  // One end is dragged away from the other, whose friction holds by a share of the sliding one's: it has to bear so much more, 1 / 1.3 of
  // the weight. Even with the loads at the edges of the soles that leaves the centre of mass too near to the sliding end, by 0.06 m.
  constexpr double kShare = 0.3, kNeeded = 0.06;
  const BoxCreature creature = make_box_creature();
  const Motion motion = standing(creature, 12);
  for (const double end : {1.0, -1.0}) {
    SCOPED_TRACE(end > 0 ? "the front is dragged" : "the back is dragged");
    ContactSchedule contacts = always_standing(creature, 12);
    for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
      if ((contacts.patches[k].name.find("front") == 0) != (end > 0)) continue;
      contacts.state[k].assign(12, ContactState::kSlide);
      contacts.sliding_x.row(static_cast<Eigen::Index>(k)).setConstant(end);
    }
    const double before = missing_wrench(motion, creature.scene, contacts, BoxCreature::kLength, kShare).colwise().norm().maxCoeff();
    Shift so_far;
    Motion moved = motion;
    for (int round = 0; round < 6; ++round) {
      const Shift shift = find_shift(moved, creature.scene, contacts, BoxCreature::kLength, kShare, 60, {}, so_far);
      add(shift, so_far);
      moved = leaned(creature, moved, shift);
    }
    const double after = missing_wrench(moved, creature.scene, contacts, BoxCreature::kLength, kShare).colwise().norm().maxCoeff();
    const Eigen::VectorXd shares = creature.scene.body.mass / creature.mass();
    const double way = -end * ((moved.at(0) - motion.at(0)) * shares).x();
    EXPECT_GT(before, 0.1);
    EXPECT_LT(after, 0.05 * before);
    EXPECT_GT(way, 0.9 * kNeeded);
    EXPECT_LT(way, 2 * kNeeded);
  }
}

/// A box that comes down on its four soles and stops within a frame; it lands in frame `landing` with `speed` [m/s].
Motion dropped(const BoxCreature& creature, Eigen::Index frames, Eigen::Index landing, double speed) {
  return played(creature, frames, false, [&](const Eigen::Vector3d& x, Eigen::Index f) {
    const double before_s = static_cast<double>(std::max<Eigen::Index>(0, landing - f)) / 60;
    return Eigen::Vector3d(x + Eigen::Vector3d(0, speed * before_s, 0));
  });
}

TEST(FindShift, AJerkThatCostsSpreadsALanding) {
  const BoxCreature creature = make_box_creature();
  for (const double speed : {0.5, 1.0, 1.5}) {
    SCOPED_TRACE("speed " + std::to_string(speed));
    const Motion motion = dropped(creature, 24, 12, speed);
    const ContactSchedule contacts = always_standing(creature, 24);
    const auto hardest_stop = [&](double jerk) {  // [m/s2]
      const Shift shift = find_shift(motion, creature.scene, contacts, 1, 0.7, 60, {0.1, jerk});
      EXPECT_TRUE(shift.converged);
      Motion com = motion;
      com.frames = shift.move;
      for (Eigen::Index f = 0; f < 24; ++f) com.frames.col(f) += physics::centre_of_mass(creature.scene.body, motion.at(f));
      return accelerations(com).row(1).maxCoeff();
    };
    const double as_drawn = 60 * speed, hard = hardest_stop(0), soft = hardest_stop(2);
    EXPECT_LT(hard, 1.01 * as_drawn);
    EXPECT_LT(soft, 0.7 * hard);
    EXPECT_LT(hardest_stop(8), soft);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::balance_test

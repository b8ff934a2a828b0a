#include "retarget/planned_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::planned_contacts_test {
namespace {

constexpr Eigen::Index kFrames = 30;  // at 60 Hz

/// A box on four legs that stands, but for its first leg, which is off the ground in frames 10 to 19.
struct Stepping {
  BoxCreature creature = make_box_creature();
  PreparedTarget plan = as_prepared(standing(creature, kFrames), always_standing(creature, kFrames));

  explicit Stepping(bool on_legs = true) {
    for (Patch& patch : plan.contacts.patches) patch.on_leg = on_legs;
    std::fill_n(plan.contacts.state[0].begin() + 10, 10, ContactState::kOff);
    for (const int p : foot().points) plan.contacts.touching.row(p).segment(10, 10).setConstant(false);
  }
  const Patch& foot() const { return plan.contacts.patches[0]; }

  /// What the corrector is told at a frame of a body that touches with all, or with all but that foot.
  ContactNow at(long frame, bool foot_touches, bool is_uneven = false) const {
    const PlannedContacts planned(plan);
    ContactNow contact = planned.first();
    for (const int p : foot().points) contact.touching[static_cast<std::size_t>(p)] = foot_touches ? ContactState::kStick : ContactState::kOff;
    planned.look((static_cast<double>(frame) + 0.5) / 60, 1.0 / 30, is_uneven, contact);
    return contact;
  }
};

TEST(PlannedContacts, AFootBearsWhereItStandsNowAndAtTheHorizonToo) {
  const Stepping stepping;
  const auto point = static_cast<std::size_t>(stepping.foot().points[0]);
  for (const long frame : {2L, 7L, 21L, 29L}) EXPECT_TRUE(stepping.at(frame, true).bearing[point]) << frame;
  for (const long frame : {8L, 9L, 10L, 19L}) EXPECT_FALSE(stepping.at(frame, true).bearing[point]) << frame;  // the horizon is two frames
}

TEST(PlannedContacts, AFootOnALegThatTouchesNothingIsInTheAirAndOnUnevenGroundOneThatIsCaughtToo) {
  const Stepping stepping;
  for (const long frame : {2L, 15L}) {
    ASSERT_EQ(stepping.at(frame, false).in_air.size(), 1u) << frame;
    EXPECT_EQ(stepping.at(frame, false).in_air[0], &stepping.foot());
    EXPECT_TRUE(stepping.at(frame, true).in_air.empty()) << frame;
    EXPECT_EQ(stepping.at(frame, true, true).in_air.size(), frame == 15 ? 1u : 0u) << frame;
    EXPECT_TRUE(Stepping(false).at(frame, false).in_air.empty()) << "a trunk does not step";
  }
}

TEST(PlannedContacts, TellsWhichPointsAreOnLegs) {
  Stepping stepping;
  stepping.plan.contacts.patches[1].on_leg = false;
  const ContactNow contact = PlannedContacts(stepping.plan).first();
  for (std::size_t k = 0; k < stepping.plan.contacts.patches.size(); ++k) {
    for (const int p : stepping.plan.contacts.patches[k].points) EXPECT_EQ(contact.on_leg[static_cast<std::size_t>(p)], k != 1);
  }
}

TEST(PlannedContacts, WhatIsToSlideHasNoGrip) {
  Stepping stepping;
  stepping.plan.contacts.state[1][4] = ContactState::kSlide;
  EXPECT_EQ(stepping.at(4, true).grip, 0);
  EXPECT_EQ(stepping.at(5, true).grip, 1);
}

TEST(PlannedContacts, InFlightNoFootIsSentAnywhere) {
  const Stepping stepping;
  const PlannedContacts planned(stepping.plan);
  ContactNow contact = planned.first();
  std::fill(contact.touching.begin(), contact.touching.end(), ContactState::kOff);
  planned.look(0, 1.0 / 30, false, contact);
  EXPECT_TRUE(contact.in_air.empty());
}

}  // namespace
}  // namespace hydrostat::retarget::planned_contacts_test

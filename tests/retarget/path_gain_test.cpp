#include "retarget/path_gain.h"

#include <gtest/gtest.h>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::path_gain_test {
namespace {

/// The gain for a box on its four soles.
CorrectorOptions gain_of(bool has_legs, double effort, bool slides = true) {
  const BoxCreature creature = make_box_creature();
  const Muscles muscles = make_muscles(creature.scene.body, creature.skeleton, creature.bone_weights);
  const Motion motion = standing(creature, 6);
  PreparedTarget target = as_prepared(motion, always_standing(creature, motion.count()));
  for (Patch& patch : target.contacts.patches) patch.on_leg = has_legs;
  if (slides) target.contacts.state[0][2] = target.contacts.state[0][3] = ContactState::kSlide;
  CorrectorOptions options;
  options.effort = effort;
  return gain_on_path({creature.scene, creature.scene, target, muscles, {}, motion, creature.scene.contact_points}, options);
}

TEST(PathGain, WhatDragsItsTrunkIsCorrectedAtMoreEffortThanLegsInProportionToWhatIsAsked) {
  for (const double effort : {1.0, 5.0}) {
    const CorrectorOptions legs = gain_of(true, effort), trunk = gain_of(false, effort);
    EXPECT_EQ(legs.effort, effort);
    EXPECT_GT(trunk.effort, 10 * effort);
    EXPECT_EQ(trunk.effort / effort, gain_of(false, 1).effort);
    EXPECT_EQ(trunk.calm, legs.calm);
    EXPECT_EQ(gain_of(false, effort, false).effort, effort) << "what stands";
  }
}

}  // namespace
}  // namespace hydrostat::retarget::path_gain_test

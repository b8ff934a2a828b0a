#include "retarget/limbs.h"

#include <gtest/gtest.h>

#include "shapes.h"

namespace hydrostat::retarget::limbs_test {
namespace {

TEST(Limbs, ShinsAreOfDifferentLimbsThighsAreNot) {
  const auto different = bones_of_different_limbs(two_legged(0.1).skeleton);
  EXPECT_TRUE(different(2, 4));
  EXPECT_TRUE(different(4, 2));
  EXPECT_FALSE(different(1, 3));
  EXPECT_FALSE(different(1, 4));
}

TEST(Limbs, AChainIsOneLimb) { EXPECT_FALSE(bones_of_different_limbs(worm().skeleton).any()); }

TEST(Limbs, BonesOfDifferentRootsAreNotToldApart) {
  const std::vector<Eigen::Vector3d> places(6, Eigen::Vector3d::Zero());
  EXPECT_FALSE(bones_of_different_limbs(skeleton_of({-1, 0, 1, -1, 3, 4}, places)).any());
}

ContactSchedule schedule_of(const std::vector<std::string>& bones) {
  ContactSchedule contacts;
  for (const std::string& bone : bones) contacts.patches.push_back({bone, {}});
  return contacts;
}

TEST(Limbs, PatchesOfDifferentLimbsAreOnLegs) {
  const Skeleton skeleton = skeleton_of({-1, 0, 1, 0, 3, 0, 5}, std::vector<Eigen::Vector3d>(7, Eigen::Vector3d::Zero()));  // two legs, a spine
  ContactSchedule feet = schedule_of({skeleton.names[0], skeleton.names[2], skeleton.names[4]});
  find_legs(skeleton, feet);
  EXPECT_FALSE(feet.patches[0].on_leg);
  EXPECT_TRUE(feet.patches[1].on_leg);
  EXPECT_TRUE(feet.patches[2].on_leg);
  ContactSchedule one = schedule_of({skeleton.names[2]});
  find_legs(skeleton, one);
  EXPECT_FALSE(one.patches[0].on_leg);
}

TEST(Limbs, AChainHasNoLegsWhereverItsRootIs) {
  const std::vector<Eigen::Vector3d> places(9, Eigen::Vector3d::Zero());
  for (const Skeleton& skeleton : {worm().skeleton, skeleton_of({-1, 0, 1, 2, 3, 0, 5, 6, 7}, places)}) {
    ContactSchedule segments = schedule_of(skeleton.names);
    find_legs(skeleton, segments);
    for (const Patch& patch : segments.patches) EXPECT_FALSE(patch.on_leg);
  }
}

TEST(Limbs, TheDominantBoneHasTheGreatestWeight) {
  SkinnedMesh skin;
  skin.vertices.resize(3, 2);
  skin.skin_weights = {{{3, 0.2}, {1, 0.5}, {7, 0.3}}, {{4, 0.5}, {2, 0.5}}};
  EXPECT_EQ(dominant_bones(skin), Eigen::Vector2i(1, 4));
}

}  // namespace
}  // namespace hydrostat::retarget::limbs_test

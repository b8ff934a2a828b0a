#include "retarget/limbs.h"

#include <gtest/gtest.h>

#include "shapes.h"

namespace hydrostat::retarget {
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

TEST(Limbs, TheDominantBoneHasTheGreatestWeight) {
  SkinnedMesh skin;
  skin.vertices.resize(3, 2);
  skin.skin_weights = {{{3, 0.2}, {1, 0.5}, {7, 0.3}}, {{4, 0.5}, {2, 0.5}}};
  EXPECT_EQ(dominant_bones(skin), Eigen::Vector2i(1, 4));
}

}  // namespace
}  // namespace hydrostat::retarget

#include "io/capsules.h"

#include <gtest/gtest.h>

#include "tests/io/refusal.h"

namespace hydrostat::io::capsules_test {
namespace {

/// An arm of three joints, 1 m and 0.5 m apart, and `others`, which no bone joins to it.
Rig arm_beside(const std::vector<Eigen::Vector3d>& others) {
  Rig rig;
  const auto add = [&](const std::string& name, int parent, const Eigen::Vector3d& place) {
    rig.skeleton.names.push_back(name);
    rig.skeleton.parents.push_back(parent);
    rig.skeleton.bind_pose.emplace_back(Eigen::Translation3d(place));
    rig.skeleton.weighted.push_back(false);
  };
  for (std::size_t k = 0; k < others.size(); ++k) add("Camera" + std::to_string(k), -1, others[k]);
  const int first = static_cast<int>(others.size());
  add("shoulder", -1, {0, 1, 0});
  add("elbow", first, {1, 1, 0});
  add("hand", first + 1, {1.5, 1, 0});
  return rig;
}

TEST(AddCapsules, AreAsThickAsTheSkeletonWantsWhateverStandsAboutBesideIt) {
  Rig alone = arm_beside({}), filmed = arm_beside({{0, 20, 50}, {300, 0, 0}});
  add_capsules(alone, "file");
  add_capsules(filmed, "file");
  EXPECT_TRUE(alone.skin.vertices.isApprox(filmed.skin.vertices, 0));
  EXPECT_NEAR(alone.skin.vertices.row(1).maxCoeff(), 1 + 0.05 * 1.5, 1e-3);  // the thickest: a third of 1 m is more
  EXPECT_EQ(filmed.skeleton.weighted, (std::vector<bool>{false, false, true, true, false}));
}

TEST(AddCapsules, RefuseASkeletonWithoutABone) {
  Rig rig = arm_beside({});
  rig.skeleton.parents.assign(3, -1);
  EXPECT_NE(refusal([&] { add_capsules(rig, "file"); }).find("file|skeleton|no bone has a length"), std::string::npos);
}

}  // namespace
}  // namespace hydrostat::io::capsules_test

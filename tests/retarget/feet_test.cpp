#include "retarget/feet.h"

#include <gtest/gtest.h>

namespace hydrostat::retarget {
namespace {

/// Patches of two points each, every point on four nodes of its own but for what `shared` patches have in common with the one before.
struct Feet {
  ContactSchedule contacts;
  physics::ContactPoints points;
};

Feet patches(const std::vector<bool>& on_leg, const std::vector<bool>& shared) {
  Feet feet;
  const int count = static_cast<int>(on_leg.size());
  feet.points.nodes.resize(4, 2 * count);
  feet.points.weights.setConstant(4, 2 * count, 0.25);
  for (int k = 0; k < count; ++k) {
    feet.contacts.patches.push_back({"bone" + std::to_string(k), {2 * k, 2 * k + 1}, on_leg[static_cast<std::size_t>(k)]});
    for (int p = 2 * k; p < 2 * k + 2; ++p) feet.points.nodes.col(p) << 4 * p, 4 * p + 1, 4 * p + 2, 4 * p + 3;
    if (shared[static_cast<std::size_t>(k)]) feet.points.nodes(3, 2 * k) = feet.points.nodes(0, 2 * k - 1);
  }
  return feet;
}

TEST(Feet, WhatSharesNodesIsOneFoot) {
  const Feet feet = patches({true, true, true, true}, {false, true, false, true});
  const std::vector<Patch> found = feet_of(feet.contacts, feet.points);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].points, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(found[1].points, (std::vector<int>{4, 5, 6, 7}));
  EXPECT_EQ(found[1].name, "bone2");
}

TEST(Feet, LegsApartAreFeetOfTheirOwn) {
  const Feet feet = patches({true, true, true}, {false, false, false});
  EXPECT_EQ(feet_of(feet.contacts, feet.points).size(), 3u);
}

TEST(Feet, WhatIsOnNoLegIsNoFootNorJoinsOne) {
  const Feet feet = patches({true, false, true}, {false, true, true});
  const std::vector<Patch> found = feet_of(feet.contacts, feet.points);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].points, (std::vector<int>{0, 1}));
  EXPECT_EQ(found[1].points, (std::vector<int>{4, 5}));
}

}  // namespace
}  // namespace hydrostat::retarget

#include "retarget/muscles.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::muscles_test {
namespace {

Muscles muscles_of(const BoxCreature& creature, int most_regions = 13) {
  return make_muscles(creature.scene.body, creature.skeleton, creature.bone_weights, most_regions);
}

std::string region_of(const std::string& muscle) { return muscle.substr(0, muscle.find('/')); }

TEST(Muscles, HaveNamesOfTheirOwn) {
  const Muscles muscles = muscles_of(make_box_creature());
  EXPECT_EQ(static_cast<Eigen::Index>(muscles.names.size()), muscles.fields.cols());
  EXPECT_EQ(std::set<std::string>(muscles.names.begin(), muscles.names.end()).size(), muscles.names.size());
  EXPECT_EQ(std::count(muscles.names.begin(), muscles.names.end(), "trunk/stretch"), 1);
  EXPECT_EQ(std::count(muscles.names.begin(), muscles.names.end(), "front_left/twist"), 1);
}

TEST(Muscles, ActInTheirRegionAlone) {
  const BoxCreature creature = make_box_creature();
  const Muscles muscles = muscles_of(creature);
  const physics::Body& body = creature.scene.body;
  for (std::size_t k = 0; k < muscles.names.size(); ++k) {
    SCOPED_TRACE(muscles.names[k]);
    const auto name = std::find(creature.skeleton.names.begin(), creature.skeleton.names.end(), region_of(muscles.names[k]));
    ASSERT_NE(name, creature.skeleton.names.end());
    const Eigen::Index bone = name - creature.skeleton.names.begin();
    const Eigen::VectorXd field = muscles.fields.col(static_cast<Eigen::Index>(k));
    EXPECT_NEAR(field.cwiseAbs().maxCoeff(), 1, 1e-12);
    for (int e = 0; e < body.edge_count(); ++e) {
      const double owned = creature.bone_weights(bone, body.edges(0, e)) + creature.bone_weights(bone, body.edges(1, e));
      if (owned == 0) {
        EXPECT_EQ(field[e], 0) << "constraint " << e;
      }
    }
  }
}

TEST(Muscles, OwnEveryConstraint) {
  const BoxCreature creature = make_box_creature();
  const Muscles muscles = muscles_of(creature);
  const physics::Body& body = creature.scene.body;
  ASSERT_EQ(static_cast<int>(muscles.edge_bone.size()), body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e) {
    const auto bone = std::find(creature.skeleton.names.begin(), creature.skeleton.names.end(), muscles.edge_bone[static_cast<std::size_t>(e)]);
    ASSERT_NE(bone, creature.skeleton.names.end());
    const auto owner = bone - creature.skeleton.names.begin();
    const Eigen::VectorXd share = creature.bone_weights.col(body.edges(0, e)) + creature.bone_weights.col(body.edges(1, e));
    EXPECT_EQ(share[owner], share.maxCoeff());
    EXPECT_GT(muscles.fields.row(e).norm(), 0) << "no muscle reaches constraint " << e;
  }
}

TEST(Muscles, SmallRegionsJoinTheirParents) {
  const BoxCreature creature = make_box_creature();
  for (const int most : {1, 2, 3, 5}) {
    const Muscles muscles = muscles_of(creature, most);
    std::set<std::string> regions;
    for (const std::string& name : muscles.names) regions.insert(region_of(name));
    EXPECT_EQ(static_cast<int>(regions.size()), most);
    EXPECT_TRUE(regions.contains("trunk"));  // legs join it, never the other way round
  }
}

TEST(Muscles, StretchAlongTheBoneAndSqueezeAcross) {
  // The leg's bone points down: its stretch moves upright constraints by all, level ones not at all.
  const BoxCreature creature = make_box_creature();
  const Muscles muscles = muscles_of(creature);
  const physics::Body& body = creature.scene.body;
  const auto k = std::find(muscles.names.begin(), muscles.names.end(), "back_right/stretch") - muscles.names.begin();
  ASSERT_LT(k, muscles.fields.cols());
  double level = 0, upright = 0;
  for (int e = 0; e < body.edge_count(); ++e) {
    const Eigen::Vector3d along = (body.rest.col(body.edges(1, e)) - body.rest.col(body.edges(0, e))).normalized();
    if (std::abs(along.y()) > 0.99) upright = std::max(upright, muscles.fields(e, k));
    if (std::abs(along.y()) < 0.01) level = std::max(level, muscles.fields(e, k));
  }
  EXPECT_EQ(upright, 1);
  EXPECT_LT(level, 0.2);
}

/// Which constraint lies where constraint e would in a mirror that swaps left and right, -1: none.
std::vector<int> mirrored_constraints(const physics::Body& body) {
  const auto mirrored_node = [&](int i) {
    Eigen::Vector3d place = body.rest.col(i);
    place.z() = 0.4 - place.z();
    for (int j = 0; j < body.node_count(); ++j) {
      if ((body.rest.col(j) - place).norm() < 1e-9) return j;
    }
    return -1;
  };
  std::map<std::pair<int, int>, int> constraint;
  for (int e = 0; e < body.edge_count(); ++e) constraint[std::minmax(body.edges(0, e), body.edges(1, e))] = e;
  std::vector<int> result;
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = mirrored_node(body.edges(0, e)), j = mirrored_node(body.edges(1, e));
    const auto found = constraint.find(std::minmax(i, j));
    result.push_back(found == constraint.end() ? -1 : found->second);
  }
  return result;
}

TEST(Muscles, OfTheLeftAreThoseOfTheRightInAMirror) {
  const BoxCreature creature = make_box_creature();
  const Muscles muscles = muscles_of(creature);
  const std::vector<int> mirror = mirrored_constraints(creature.scene.body);
  ASSERT_GT(std::count_if(mirror.begin(), mirror.end(), [](int e) { return e >= 0; }), creature.scene.body.edge_count() / 2);
  for (std::size_t k = 0; k < muscles.names.size(); ++k) {
    const std::string& name = muscles.names[k];
    const auto side = name.find("_right/");
    if (side == std::string::npos) continue;
    SCOPED_TRACE(name);
    std::string other = name;
    other.replace(side, 7, "_left/");
    const auto partner = std::find(muscles.names.begin(), muscles.names.end(), other);
    ASSERT_NE(partner, muscles.names.end());
    const Eigen::Index left = partner - muscles.names.begin(), right = static_cast<Eigen::Index>(k);
    double same = 0, opposite = 0;
    for (std::size_t e = 0; e < mirror.size(); ++e) {
      if (mirror[e] < 0) continue;
      same = std::max(same, std::abs(muscles.fields(static_cast<Eigen::Index>(e), right) - muscles.fields(mirror[e], left)));
      opposite = std::max(opposite, std::abs(muscles.fields(static_cast<Eigen::Index>(e), right) + muscles.fields(mirror[e], left)));
    }
    EXPECT_LT(std::min(same, opposite), 1e-9);  // what turns about an axis turns the other way in a mirror
  }
}

}  // namespace
}  // namespace hydrostat::retarget::muscles_test

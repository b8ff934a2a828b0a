#include "retarget/sag.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "physics/internal_forces.h"
#include "retarget/prepare_standing.h"
#include "tests/retarget/box_creature.h"
#include "tests/retarget/shapes.h"

namespace hydrostat::retarget::sag_test {
namespace {

/// A body that stands on its soles at rest.
struct Standing {
  physics::Scene scene;
  PreparedTarget prepared;

  explicit Standing(const physics::Body& body) : scene(physics::scene_of(body, physics::soles(body))) {
    prepared.target.frames = body.rest.reshaped().replicate(1, 3);
    prepared.contacts.touching.setConstant(scene.contact_points.count(), 3, true);
  }
};

physics::Material soft(double softness, double length) {
  physics::Material material;
  material.youngs_modulus = material.density * 9.81 * length / softness;
  return material;
}

/// By how much the body's weight has sunk when it has come to rest, its soles held fast [per length].
double settled(const Standing& standing, double length) {
  constexpr double kStep = 1.0 / 480;
  physics::Scene scene = standing.scene;
  scene.has_ground = false;
  scene.body.held = physics::soles(scene.body);
  physics::State state{scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count()), {}};
  const auto stepper = physics::make_explicit_stepper(scene);
  physics::Impulses impulses = physics::make_impulses(scene);
  const Eigen::VectorXd activation = Eigen::VectorXd::Ones(scene.body.edge_count());
  for (int k = 0; k < 480; ++k) stepper->step(kStep, activation, nullptr, state, impulses);
  EXPECT_LT(state.v.colwise().norm().maxCoeff(), 1e-3);
  return ((scene.body.rest - state.x).row(1) * scene.body.mass)(0) / scene.body.mass.sum() / length;
}

TEST(Sag, IsWhatABodySinksByWhenItIsLetGo) {
  for (const double softness : {0.002, 0.005}) {
    const physics::Material material = soft(softness, 0.9);
    for (const Standing& body : {Standing(physics::bar(2, 6, 2, 0.1, material)), Standing(physics::bar(1, 4, 2, 0.1, material)),
                                 Standing(physics::four_legged(material))}) {
      SCOPED_TRACE(std::to_string(body.scene.body.node_count()) + " nodes, softness " + std::to_string(softness));
      const double sunk = settled(body, 0.9);
      EXPECT_NEAR(sag(body.scene, body.prepared, 0.9) / sunk, 1, 0.02);
    }
  }
}

TEST(Sag, IsTheLimitsWhereTheBodyIsAsStiffAsThatAsks) {
  std::mt19937 random(5);
  for (int seed = 0; seed < 8; ++seed) {
    const double softness = 0.005 * std::pow(10, 3 * static_cast<double>(random()) / 4294967295.0);
    SCOPED_TRACE(softness);
    Standing box(physics::four_legged(soft(softness, 0.9)));
    const double before = sag(box.scene, box.prepared, 0.9), factor = stiffness_to_bear(before);
    EXPECT_EQ(factor > 1, before > kMostSag);
    EXPECT_LE(factor, kMostStiffening);
    stiffen(factor, box.scene.body);
    const double after = factor < kMostStiffening ? std::min(before, kMostSag) : before / kMostStiffening;
    EXPECT_NEAR(sag(box.scene, box.prepared, 0.9), after, 1e-9);
  }
}

TEST(Sag, IsNoneWithoutWeightOrAFoot) {
  Standing box(physics::four_legged(soft(0.5, 0.9)));
  EXPECT_GT(sag(box.scene, box.prepared, 0.9), kMostSag);
  Standing flying = box;
  flying.prepared.contacts.touching.setConstant(false);
  EXPECT_EQ(sag(flying.scene, flying.prepared, 0.9), 0);
  box.scene.gravity.setZero();
  EXPECT_EQ(sag(box.scene, box.prepared, 0.9), 0);
  EXPECT_EQ(stiffness_to_bear(0), 1);
}

TEST(Stiffen, MultipliesTheForcesOfElementsAndSprings) {
  std::vector<BoxCreature> boxes = element_box_creatures();
  boxes.push_back(make_box_creature());
  for (BoxCreature& box : boxes) {
    std::mt19937 random(7);
    const Eigen::Matrix3Xd x = box.scene.body.rest + physics::random_points(random, box.scene.body.node_count(), 0.01);
    const auto forces = [&] {
      Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, box.scene.body.node_count());
      physics::InternalForces<3>(box.scene.body).add_elastic_forces(x, force);
      return force;
    };
    const Eigen::Matrix3Xd before = forces();
    stiffen(2.5, box.scene.body);
    EXPECT_LT((forces() - 2.5 * before).norm(), 1e-9 * before.norm());
  }
}

/// Something that grows with the body's stiffness as a factor does.
double stiffness_of(const physics::Body& body) {
  return body.elements.empty() ? body.edge_stiffness.sum() : body.elements[0].materials[0].youngs_modulus;
}

/// A block of 1 x 0.4 x 0.5 m on one bone that stands for a second.
Character block() {
  Character character;
  character.skeleton = one_bone();
  character.skin = box_skin({0, 0, 0}, Eigen::Vector3d(1, 0.4, 0.5), 0, 8);
  character.clip.rate_hz = character.clip.key_rate_hz = 60;
  character.clip.duration_s = character.clip.range_s = 1;
  character.clip.bone_pose.assign(61, {Eigen::Affine3d::Identity()});
  return character;
}

TEST(PrepareStanding, MakesASoftBodyAsStiffAsItsWeightAsks) {
  for (const BodyMaterial material : {BodyMaterial::kSprings, BodyMaterial::kStableNeoHookean}) {
    for (const double softness : {0.005, 2.0, 40.0}) {
      SCOPED_TRACE(name_of(material) + ", softness " + std::to_string(softness));
      CreatureOptions options;
      options.softness = softness;
      options.material = material;
      options.nodes = 60;
      Creature creature = make_creature(block(), options);
      const PreparedTarget prepared = prepare_standing(creature, import_motion(creature, options), options);
      physics::Scene springs = preparation_scene(creature);
      fit_body(prepared, springs.body);
      EXPECT_EQ(prepared.stiffness > 1, softness > 1);
      const bool is_too_soft = softness > 2;  // for all that may be made of it
      EXPECT_EQ(sag(springs, prepared, creature.length) > kMostSag + 1e-9, is_too_soft);
      ASSERT_EQ(prepared.warnings.empty(), softness < 1);
      for (const std::string& warning : prepared.warnings) EXPECT_EQ(warning.find("still sinks") != std::string::npos, is_too_soft) << warning;
      const double before = stiffness_of(creature.scene.body);
      fit_body(prepared, creature.scene.body);
      EXPECT_NEAR(stiffness_of(creature.scene.body) / before, prepared.stiffness, 1e-9);
    }
  }
}

}  // namespace
}  // namespace hydrostat::retarget::sag_test

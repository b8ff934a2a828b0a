#include "retarget/strength_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "physics/stepper.h"
#include "retarget/performance.h"
#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::strength_estimate_test {
namespace {

constexpr double kStep = 1.0 / 480, kLook = 1.0 / 120;

/// A box that bends and stretches on its soles or in the air, and what is thought of it.
struct Watched {
  BoxCreature creature = make_box_creature();
  physics::Scene plant;
  StrengthEstimate strength{creature.scene, kLook};
  physics::State state;

  explicit Watched(const Variation& variation) : plant(varied_scene(creature.scene, variation)) {
    state.x = creature.scene.body.rest;
    state.v.setZero(3, state.x.cols());
  }

  /// For `seconds` [s]; what is seen of velocities is wrong by a noise of `noise` [m/s].
  void play(unsigned seed, double seconds, double noise = 0, const Eigen::Matrix3Xd* effect = nullptr) {
    const auto stepper = physics::make_stepper(physics::Method::kExplicit, plant);
    physics::Impulses impulses = physics::make_impulses(plant);
    std::mt19937 random(seed);
    const auto even = [&random] { return 2 * static_cast<double>(random()) / 4294967295.0 - 1; };
    Eigen::VectorXd share(plant.body.edge_count()), activation(share.size());
    for (double& s : share) s = even();
    for (long k = 0; k < std::lround(seconds / kStep); ++k) {
      activation = (1 + 0.03 * std::sin(12 * kStep * static_cast<double>(k)) * share.array()).matrix();
      physics::State before = state;
      ASSERT_EQ(stepper->step(kStep, activation, effect, state, impulses), physics::Termination::kDone);
      if (k % 4 != 3) continue;
      physics::State after = state;
      if (noise > 0) {
        for (double& v : before.v.reshaped()) v += noise * even();
        for (double& v : after.v.reshaped()) v += noise * even();
      }
      strength.look(kStep, before, after, activation, impulses);
    }
  }
};

/// By seed; 0 is the plan's.
Variation any_variation(unsigned seed) { return variation_of(seed, 0.25); }

TEST(StrengthEstimate, IsThatOfTheBodyWithinAPercent) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Variation variation = any_variation(seed);
    Watched watched(variation);
    watched.play(seed, 0.6);
    EXPECT_NEAR(watched.strength.ratio() / (variation.stiffness / variation.mass), 1, 0.01);
    EXPECT_NEAR(watched.strength.mass_ratio() / variation.mass, 1, 1e-3);
  }
}

TEST(StrengthEstimate, InTheAirWhereLittlePullsThePlanIsKept) {
  for (unsigned seed = 1; seed < 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Variation variation = any_variation(seed);
    Watched watched(variation);
    watched.plant.has_ground = false;
    watched.play(seed, 0.4);
    EXPECT_LT(std::abs(watched.strength.ratio() - 1), std::max(0.05, std::abs(variation.stiffness / variation.mass - 1)));
    EXPECT_EQ(watched.strength.mass_ratio(), 1);
  }
}

TEST(StrengthEstimate, WhatIsSeenBadlyLeavesThePlan) {
  const Variation variation{1, 1, 1.2};
  Watched sure(variation), unsure(variation), blind(variation);
  sure.play(1, 0.3);
  unsure.play(1, 0.3, 0.002);
  blind.play(1, 0.3, 1);
  EXPECT_NEAR(unsure.strength.ratio(), sure.strength.ratio(), 0.04);
  EXPECT_NEAR(blind.strength.ratio(), 1, 0.1);
}

TEST(StrengthEstimate, AnEffectTellsNothing) {
  Watched watched({1.2, 1, 1});
  const Eigen::Matrix3Xd effect = Eigen::Matrix3Xd::Constant(3, watched.state.x.cols(), 0.01);
  watched.play(1, 0.1, 0, &effect);
  EXPECT_EQ(watched.strength.ratio(), 1);
  EXPECT_EQ(watched.strength.mass_ratio(), 1);
}

TEST(StrengthEstimate, SignalsPullAsHardForTheMassAsInThePlan) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Variation variation = any_variation(seed);
    Watched watched(variation);
    const physics::Body& body = watched.creature.scene.body;
    Eigen::VectorXd planned = Eigen::VectorXd::Constant(body.edge_count(), 0.97), changed = planned;
    watched.strength.apply(body.rest, changed);
    EXPECT_EQ(changed, planned);  // nothing is known yet
    watched.play(seed, 0.6);
    watched.strength.apply(body.rest, changed);
    physics::InternalForces<3> plan(body), real(watched.plant.body);
    Eigen::Matrix3Xd pull = Eigen::Matrix3Xd::Zero(3, body.node_count()), real_pull = pull;
    plan.set_activation(planned);
    plan.add_elastic_forces(body.rest, pull);
    real.set_activation(changed);
    real.add_elastic_forces(body.rest, real_pull);
    EXPECT_LT((real_pull / variation.mass - pull).norm(), 0.01 * pull.norm());
  }
}

}  // namespace
}  // namespace hydrostat::retarget::strength_estimate_test

#include "retarget/slope_lean.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::slope_lean_test {
namespace {

constexpr Eigen::Index kFrames = 6;
constexpr double kDegree = M_PI / 180;

/// Gravity in the frame of a ground that rises by `slope` [rad] towards x, turned by `side` [rad] about y.
Eigen::Vector3d gravity_on(double slope, double side) {
  return 9.81 * (Eigen::AngleAxisd(side, Eigen::Vector3d::UnitY()) * Eigen::Vector3d(-std::sin(slope), -std::cos(slope), 0));
}

/// The box stands on its four legs, or lies on them as if they were none of its own.
struct Standing {
  BoxCreature creature = make_box_creature();
  PreparedTarget plan = as_prepared(standing(creature, kFrames), always_standing(creature, kFrames));

  explicit Standing(bool on_legs = true) {
    for (Patch& patch : plan.contacts.patches) patch.on_leg = on_legs;
  }
  /// Wider, or longer, about the origin.
  void spread(double along_x, double along_z) {
    const Eigen::Vector3d scale(along_x, 1, along_z);
    creature.scene.body.rest = scale.asDiagonal() * creature.scene.body.rest;
    plan.target = standing(creature, kFrames);
  }
  void turn(double yaw) {
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    creature.scene.body.rest = rotation * creature.scene.body.rest;
    plan.target = standing(creature, kFrames);
  }
  SlopeLean on(double slope, double side) {
    creature.scene.gravity = gravity_on(slope, side);
    return {plan, creature.scene};
  }
};

TEST(SlopeLean, LeadsUphillAndNeverBeyondTheVertical) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<> draw(0, 1);
    Standing standing;
    standing.spread(0.2 + 3 * draw(random), 0.2 + 3 * draw(random));
    const double slope = (1 + 20 * draw(random)) * kDegree, side = 2 * M_PI * draw(random);
    const Eigen::Vector3d lean = standing.on(slope, side).at(2 * M_PI * draw(random));
    const Eigen::Vector3d uphill = Eigen::AngleAxisd(side, Eigen::Vector3d::UnitY()) * Eigen::Vector3d::UnitX();
    EXPECT_GT(lean.dot(uphill), 0.3 * std::tan(slope) - 1e-12);  // the floor of what stands on legs
    EXPECT_LT(lean.norm(), std::tan(slope));
    EXPECT_EQ(lean.y(), 0);
  }
}

TEST(SlopeLean, AcrossALongBaseIsNearlyAllAndAlongItIsLess) {
  Standing standing;
  double across_before = 0, along_before = 1;
  for (const double length : {1.0, 2.0, 4.0}) {
    standing.spread(length == 1 ? 1 : 2, length == 1 ? 0.2 : 0.5);  // twice as long and half as wide each time
    const double all = std::tan(5 * kDegree);
    const double along = standing.on(5 * kDegree, 0).at(0).norm() / all, across = standing.on(5 * kDegree, M_PI / 2).at(0).norm() / all;
    EXPECT_GT(across, along + 0.1);
    EXPECT_GT(across, across_before);
    EXPECT_LT(along, along_before);
    across_before = across, along_before = along;
  }
  EXPECT_GT(across_before, 0.95);
  EXPECT_LT(along_before, 0.5);
}

TEST(SlopeLean, IsTheSameFromEverySide) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<> draw(-M_PI, M_PI);
    const double side = draw(random), yaw = draw(random);
    Standing plain, turned;
    plain.spread(1.7, 0.6);
    turned.spread(1.7, 0.6);
    turned.turn(yaw);
    const Eigen::Vector3d expected = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) * plain.on(0.1, side).at(0);
    EXPECT_LT((turned.on(0.1, side + yaw).at(0) - expected).norm(), 1e-12);
    EXPECT_LT((plain.on(0.1, side + yaw).at(yaw) - expected).norm(), 1e-12);  // a body that has turned on its way
  }
}

TEST(SlopeLean, LeavesFeetInTheirPlacesAndGivesSignalsTheLengthsOfTheLeaningBody) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<> draw(-1, 1);
    Standing standing;
    SlopeLean lean = standing.on(0.15, M_PI * draw(random));
    const physics::Body& body = standing.creature.scene.body;
    physics::State reference{body.rest, Eigen::Matrix3Xd::Zero(3, body.node_count())};
    reference.x += Eigen::Matrix3Xd::NullaryExpr(3, body.node_count(), [&] { return 0.005 * draw(random); });
    reference.v = Eigen::Matrix3Xd::NullaryExpr(3, body.node_count(), [&] { return draw(random); });
    const physics::State level = reference;
    lean.apply(lean.at(0), body.edges, reference);
    for (int i = 0; i < body.node_count(); ++i) {
      EXPECT_LT((reference.x.col(i) - level.x.col(i) - level.x(1, i) * lean.at(0)).norm(), 1e-12);
      EXPECT_LT((reference.v.col(i) - level.v.col(i) - level.v(1, i) * lean.at(0)).norm(), 1e-12);
    }
    Eigen::VectorXd activation = Eigen::VectorXd::NullaryExpr(body.edge_count(), [&] { return 1 + 0.1 * draw(random); });
    const Eigen::VectorXd signals = activation;
    lean.apply(activation);
    for (int e = 0; e < body.edge_count(); ++e) {
      const auto length = [&](const physics::State& s) { return (s.x.col(body.edges(1, e)) - s.x.col(body.edges(0, e))).norm(); };
      EXPECT_NEAR(activation[e] / signals[e], length(reference) / length(level), 1e-12);
    }
  }
}

TEST(SlopeLean, IsNotNeededOnTheLevelWithoutGroundOrWhereNothingStandsOrDragsItself) {
  EXPECT_FALSE(Standing().on(0, 0).is_needed());
  EXPECT_FALSE(Standing(/*on_legs=*/false).on(0.1, 0).is_needed());
  Standing afloat;
  afloat.creature.scene.has_ground = false;
  EXPECT_FALSE(afloat.on(0.1, 0).is_needed());
  Standing dragged(/*on_legs=*/false);
  for (auto& states : dragged.plan.contacts.state) std::fill(states.begin(), states.end(), ContactState::kSlide);
  EXPECT_TRUE(dragged.on(0.1, 0).is_needed());
  Eigen::VectorXd activation = Eigen::VectorXd::Constant(3, 1.1);
  Standing().on(0, 0).apply(activation);
  EXPECT_EQ(activation, Eigen::VectorXd::Constant(3, 1.1));
}

}  // namespace
}  // namespace hydrostat::retarget::slope_lean_test

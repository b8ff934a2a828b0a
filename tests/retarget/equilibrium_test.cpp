#include "retarget/equilibrium.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::equilibrium_test {
namespace {

std::vector<BoxCreature> creatures() {
  std::vector<BoxCreature> all = element_box_creatures();
  all.push_back(make_box_creature());
  all.push_back(make_tiptoe_box());
  return all;
}

PlannedMoment at_rest(const BoxCreature& creature, ContactState touch) {
  const physics::Body& body = creature.scene.body;
  PlannedMoment moment;
  moment.state = {body.rest, Eigen::Matrix3Xd::Zero(3, body.node_count())};
  moment.activation = Eigen::VectorXd::Ones(body.edge_count());
  moment.touching.assign(static_cast<std::size_t>(creature.scene.contact_points.count()), touch);
  return moment;
}

/// At rest with activations that are off by up to `most`, moving and accelerating.
PlannedMoment disturbed(const BoxCreature& creature, ContactState touch, double most, unsigned seed, Eigen::Matrix3Xd& acceleration) {
  PlannedMoment moment = at_rest(creature, touch);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (double& activation : moment.activation) activation += most * uniform(random);
  for (double& speed : moment.state.v.reshaped()) speed = 0.02 * uniform(random);
  acceleration = moment.state.v * 10;
  return moment;
}

TEST(Equilibrium, BalancesWhatActivationsLeaveAtTheNodes) {
  for (const BoxCreature& creature : creatures()) {
    Equilibrium equilibrium(creature.scene, BoxCreature::kLength);
    const double node_weight = 9.81 * creature.mass() / creature.scene.body.node_count();
    for (unsigned seed = 0; seed < 4; ++seed) {
      SCOPED_TRACE("nodes " + std::to_string(creature.scene.body.node_count()) + ", seed " + std::to_string(seed));
      Eigen::Matrix3Xd acceleration;
      const PlannedMoment plan = disturbed(creature, ContactState::kStick, 0.01, seed, acceleration);
      PlannedMoment settled = plan;
      equilibrium.settle(acceleration, settled);
      const double per_node = std::sqrt(static_cast<double>(plan.state.x.cols()));
      EXPECT_GT(equilibrium.missing(acceleration, plan, plan.state.x).norm() / per_node, node_weight);
      EXPECT_LE(equilibrium.missing(acceleration, plan, settled.state.x).norm() / per_node, 0.01 * node_weight);
      EXPECT_LE((settled.state.x - plan.state.x).norm() / per_node, 0.02 * BoxCreature::kLength);
      EXPECT_EQ(settled.state.v, plan.state.v);
      EXPECT_EQ(settled.activation, plan.activation);
    }
  }
}

/// What falls freely at rest balances, and so it stays where it is.
TEST(Equilibrium, LeavesWhatBalancesWhereItIs) {
  for (const BoxCreature& creature : creatures()) {
    PlannedMoment moment = at_rest(creature, ContactState::kOff);
    const Eigen::Matrix3Xd planned = moment.state.x;
    Equilibrium(creature.scene, BoxCreature::kLength).settle(creature.scene.gravity.replicate(1, planned.cols()), moment);
    EXPECT_LE((moment.state.x - planned).cwiseAbs().maxCoeff(), 1e-9);
  }
}

/// In a flight that does not fall freely nothing holds the body: it moves as a whole, and not far.
TEST(Equilibrium, MovesWhatFloatsAsAWhole) {
  for (const BoxCreature& creature : creatures()) {
    PlannedMoment moment = at_rest(creature, ContactState::kOff);
    const Eigen::Matrix3Xd planned = moment.state.x;
    Equilibrium(creature.scene, BoxCreature::kLength).settle(0.9 * creature.scene.gravity.replicate(1, planned.cols()), moment);
    const Eigen::Matrix3Xd moved = moment.state.x - planned;
    const Eigen::Vector3d mean = moved.rowwise().mean();
    EXPECT_NEAR(mean.y(), -0.01 * 0.981, 1e-3 * 0.00981);  // a tenth of g for (0.1 s)^2
    EXPECT_LE((moved.colwise() - mean).cwiseAbs().maxCoeff(), 1e-3 * 0.00981);
  }
}

TEST(Equilibrium, DoesNotHangOnWhereTheMotionHeads) {
  const BoxCreature creature = make_box_creature();
  Equilibrium equilibrium(creature.scene, BoxCreature::kLength);
  Eigen::Matrix3Xd acceleration;
  PlannedMoment ahead = disturbed(creature, ContactState::kStick, 0.01, 1, acceleration);
  for (const double yaw : {0.7, -2.0}) {
    const Eigen::Matrix3d heading = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    PlannedMoment turned = ahead, settled = ahead;
    turned.state = {heading * ahead.state.x, heading * ahead.state.v};
    equilibrium.settle(heading * acceleration, turned);
    equilibrium.settle(acceleration, settled);
    EXPECT_LE((turned.state.x - heading * settled.state.x).cwiseAbs().maxCoeff(), 1e-9);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::equilibrium_test

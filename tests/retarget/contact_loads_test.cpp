#include "retarget/contact_loads.h"

#include <gtest/gtest.h>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::contact_loads_test {
namespace {

constexpr double kStep = 1.0 / 120;

/// The box at rest, each sole point with an even share of its weight.
struct Standing {
  BoxCreature creature = make_box_creature();
  physics::State state{creature.scene.body.rest, Eigen::Matrix3Xd::Zero(3, creature.scene.body.node_count())};
  Eigen::Matrix3Xd impulse = Eigen::Vector3d(0, creature.mass() * 9.81 * kStep / creature.scene.contact_points.count(), 0)
                                 .replicate(1, creature.scene.contact_points.count());
  ContactThresholds thresholds = contact_thresholds(creature.scene, BoxCreature::kLength, kStep);

  ContactState point(int p) const {
    return point_states(creature.scene, state, impulse, thresholds)[static_cast<std::size_t>(p)];
  }
  PatchLoad patch(std::size_t k) const {
    return patch_load(creature.scene, always_standing(creature, 1).patches[k], state, impulse);
  }
  double gap(std::size_t k) const { return patch_height(creature.scene, always_standing(creature, 1).patches[k], state); }
};

TEST(PointStates, HoldWhereLoadRestsAndAreAwayWithout) {
  Standing standing;
  standing.impulse.col(2).setZero();
  for (int p = 0; p < standing.creature.scene.contact_points.count(); ++p) {
    EXPECT_EQ(standing.point(p), p == 2 ? ContactState::kOff : ContactState::kStick) << p;
  }
}

TEST(PointStates, SlideAlongTheGroundAndNotOffIt) {
  Standing standing;
  standing.state.v.row(0).setConstant(0.9 * standing.thresholds.sliding_speed);
  EXPECT_EQ(standing.point(0), ContactState::kStick);
  standing.state.v.row(2).setConstant(0.9 * standing.thresholds.sliding_speed);
  EXPECT_EQ(standing.point(0), ContactState::kSlide);
  standing.state.v.setZero();
  standing.state.v.row(1).setConstant(10);
  EXPECT_EQ(standing.point(0), ContactState::kStick);
}

TEST(PatchLoads, AddUpToTheWeight) {
  const Standing standing;
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += standing.patch(k).normal_impulse;
  EXPECT_NEAR(sum, standing.creature.mass() * 9.81 * kStep, 1e-9);
}

TEST(PatchLoads, APatchThatTurnsOnTheSpotMoves) {
  Standing standing;
  const Patch patch = always_standing(standing.creature, 1).patches[0];
  const physics::ContactPoints& points = standing.creature.scene.contact_points;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const int p : patch.points) middle += points.of(standing.state.x, p) / static_cast<double>(patch.points.size());
  double mean = 0;
  for (const int p : patch.points) mean += (points.of(standing.state.x, p) - middle).norm() / static_cast<double>(patch.points.size());
  ASSERT_GT(mean, 0);
  for (Eigen::Index i = 0; i < standing.state.x.cols(); ++i) {
    standing.state.v.col(i) = Eigen::Vector3d(0, 2, 0).cross(Eigen::Vector3d(standing.state.x.col(i) - middle));
  }
  EXPECT_NEAR(standing.patch(0).speed, 2 * mean, 0.01 * mean);
}

TEST(PatchLoads, MoveAsTheirLoadedPointsDo) {
  Standing standing;
  const Patch patch = always_standing(standing.creature, 1).patches[0];
  standing.state.v.row(0).setConstant(0.3);
  standing.state.v.row(1).setConstant(5);
  EXPECT_NEAR(standing.patch(0).speed, 0.3, 1e-12);
  for (const int p : patch.points) standing.impulse.col(p).setZero();
  EXPECT_EQ(standing.patch(0).speed, 0);
  EXPECT_EQ(standing.patch(0).normal_impulse, 0);
}

TEST(PatchLoads, GapIsThatOfTheLowestPoint) {
  Standing standing;
  standing.state.x.row(1).array() += 0.07;
  EXPECT_NEAR(standing.gap(1), 0.07, 1e-12);
  standing.creature.scene.ground.offset = 0.02;
  EXPECT_NEAR(standing.gap(1), 0.05, 1e-12);
}

}  // namespace
}  // namespace hydrostat::retarget::contact_loads_test

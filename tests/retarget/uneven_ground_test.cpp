#include "retarget/uneven_ground.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::uneven_ground_test {
namespace {

constexpr double kLength = BoxCreature::kLength, kStep = 0.03 * kLength, kClearance = 0.03, kStride = 0.3;  // [m] but for the clearance
constexpr double kSpeed = 1.8, kSettle = 0.1;  // [m/s], [s]
constexpr Eigen::Index kFrames = 20, kLanding = 10;
constexpr std::size_t kFoot = 2;  // of the patches: front right, whose sole lies at x = 0.4 to 0.5 m at first

/// The box goes along x by a stride in ten frames and stands; its front right foot is in the air on the way.
struct Walk {
  BoxCreature creature = make_box_creature();
  PreparedTarget plan = walking(creature);
  physics::State state{creature.scene.body.rest, Eigen::Matrix3Xd::Zero(3, creature.scene.body.node_count())};
  RigidFit fit{Eigen::Matrix3d::Identity(), state.x.rowwise().mean(), state.x.rowwise().mean(), 0};

  static PreparedTarget walking(const BoxCreature& creature) {
    const Motion motion = played(creature, kFrames, false, [](const Eigen::Vector3d& x, Eigen::Index f) {
      const double way = kStride * static_cast<double>(std::min(f, kLanding)) / kLanding;
      return Eigen::Vector3d(x + way * Eigen::Vector3d::UnitX());
    });
    PreparedTarget plan = as_prepared(motion, always_standing(creature, kFrames));
    for (Patch& patch : plan.contacts.patches) patch.on_leg = true;
    std::fill_n(plan.contacts.state[kFoot].begin(), kLanding, ContactState::kOff);
    return plan;
  }

  /// A step that begins at x = edge [m].
  void put_step(double edge) {
    physics::ObstacleOf<3> box;
    box.shape = physics::BoxOf<3>{Eigen::Vector3d(1, kStep, 2)};
    box.place = Eigen::Vector3d(edge + 1, 0, 0);
    creature.scene.obstacles = {box};
  }

  /// By how much the front right foot is led from the reference, at the start.
  Eigen::Vector3d led() const {
    UnevenGround ground(creature.scene, plan, kLength, kClearance);
    ground.look(0, 1.0 / 120, fit, state);
    physics::State reference = state;
    reference.v.row(0).setConstant(kSpeed);
    std::vector<Eigen::Vector3d> moves;
    ground.lead({&plan.contacts.patches[kFoot]}, state, reference, kSettle, moves);
    ground.apply(physics::centre_of_mass(creature.scene.body, state.x), reference);
    Eigen::Vector3d raised = Eigen::Vector3d::Zero();  // what the reference is raised by, there
    for (const int p : plan.contacts.patches[kFoot].points) {
      raised += (creature.scene.contact_points.of(reference.x, p) - creature.scene.contact_points.of(state.x, p)) /
                static_cast<double>(plan.contacts.patches[kFoot].points.size());
    }
    return moves.at(0) + raised.y() * Eigen::Vector3d::UnitY();
  }
};

TEST(UnevenGround, AFootThatWouldLandAcrossAnEdgeIsLedToTheNearestLevelPlaceOnItsWay) {
  Walk walk;
  const double from = 0.4 + kStride, until = 0.5 + kStride, margin = 0.02 * kLength, farthest = 0.08 * kLength;
  int short_of = 0, beyond = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    const double edge = std::uniform_real_distribution<double>(from - 0.05, until + 0.05)(random);
    SCOPED_TRACE("edge at " + std::to_string(edge));
    walk.put_step(edge);
    const double back = until + margin - edge, on = edge - (from - margin);  // how far it is to go to stand clear of the edge
    const double least = std::min(back, on), aside = walk.led().x();
    if (least <= 0 || least > farthest) {
      EXPECT_NEAR(aside, 0, 1e-12);
    } else {
      EXPECT_NEAR(aside, back < on ? -back : on, 0.01 * kLength);
      ++(back < on ? short_of : beyond);
    }
  }
  EXPECT_GT(short_of, 0);
  EXPECT_GT(beyond, 0);
}

TEST(UnevenGround, AFootIsLiftedOverWhatLiesAheadByTheClearanceAndNotOverWhatLiesBeyond) {
  Walk walk;
  for (const double edge : {0.55, 0.6, 0.65}) {
    SCOPED_TRACE("edge at " + std::to_string(edge));
    walk.put_step(edge);
    EXPECT_NEAR(walk.led().y(), kStep + kClearance * kLength, 0.1 * kStep);
    walk.put_step(edge + 0.5);
    EXPECT_NEAR(walk.led().y(), 0, 1e-12);
  }
}

TEST(UnevenGround, AFootBeforeARiserGoesUpBeforeItGoesOn) {
  Walk walk;
  for (const double gap : {0.001, 0.004, 0.009}) {  // [m] between toe and riser; a foot minds what is within 2 % of L
    SCOPED_TRACE("gap " + std::to_string(gap));
    walk.put_step(0.5 + gap);
    EXPECT_LT(walk.led().x() + kSpeed * kSettle, 0);  // not on, and a little back
    EXPECT_GE(walk.led().y(), kStep + kClearance * kLength - 1e-6);
    walk.state.x.row(1).array() += kStep + 0.001;  // over it: on
    EXPECT_GE(walk.led().x(), -1e-12);
    walk.state.x.row(1).array() -= kStep + 0.001;
  }
  walk.put_step(0.5 + 0.03 * kLength);
  EXPECT_GE(walk.led().x(), -0.08 * kLength);
}

}  // namespace
}  // namespace hydrostat::retarget::uneven_ground_test

#include "retarget/slip_meter.h"

#include <gtest/gtest.h>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::slip_meter_test {
namespace {

constexpr double kStep = 1.0 / 480;

/// The box on its four soles, which glide together.
class Glide {
 public:
  explicit Glide(ContactState planned = ContactState::kStick) : prepared_(as_prepared(standing(creature_, 6), always_standing(creature_, 6))) {
    for (std::vector<ContactState>& states : prepared_.contacts.state) states.assign(states.size(), planned);
  }

  void go(double seconds, double speed, bool is_loaded = true) {
    state_.v.row(0).setConstant(speed);
    impulse_.setZero();
    if (is_loaded) impulse_.row(1).setConstant(creature_.mass() * 9.81 * kStep / static_cast<double>(impulse_.cols()));
    for (long k = 0; k < std::lround(seconds / kStep); ++k) meter_.add(++steps_ * kStep, state_, impulse_);
  }
  const SlipMeter& meter() const { return meter_; }

 private:
  BoxCreature creature_ = make_box_creature();
  PreparedTarget prepared_;
  SlipMeter meter_{creature_.scene, prepared_, BoxCreature::kLength, kStep};
  physics::State state_{creature_.scene.body.rest, Eigen::Matrix3Xd::Zero(3, creature_.scene.body.node_count())};
  Eigen::Matrix3Xd impulse_ = Eigen::Matrix3Xd::Zero(3, creature_.scene.contact_points.count());
  long steps_ = 0;
};

TEST(SlipMeter, SlipIsTheWayOfLoadedPatchesAlone) {
  Glide glide;
  EXPECT_EQ(glide.meter().per_stance(), 0);
  glide.go(0.05, 0.5);
  glide.go(0.05, 0);
  EXPECT_NEAR(glide.meter().per_stance(), 0.025, 1e-12);
  glide.go(0.5, 5, false);
  EXPECT_NEAR(glide.meter().per_stance(), 0.025, 1e-12);
}

TEST(SlipMeter, WhatBouncesIsInOneStance) {
  Glide glide;
  for (int k = 0; k < 10; ++k) {
    glide.go(0.05, 0.1);
    glide.go(0.05, 0.1, false);
  }
  EXPECT_NEAR(glide.meter().per_stance(), 10 * 0.005, 1e-12);
  glide.go(0.05, 0.1, false);  // 0.1 s in all: it has let go
  glide.go(0.1, 0.1);
  EXPECT_NEAR(glide.meter().per_stance(), (10 * 0.005 + 0.01) / 2, 1e-12);
}

TEST(SlipMeter, WhatTheTargetDragsOrLiftsIsNotHeld) {
  for (const ContactState planned : {ContactState::kOff, ContactState::kStick, ContactState::kSlide}) {
    Glide glide(planned);
    glide.go(0.2, 0.1);
    EXPECT_NEAR(glide.meter().per_stance(), 0.02, 1e-12);
    EXPECT_NEAR(glide.meter().held_per_stance(), planned == ContactState::kStick ? 0.02 : 0, 1e-12);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::slip_meter_test

#include "retarget/return_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::return_map_test {
namespace {

constexpr double kLength = BoxCreature::kLength, kPeriod = 2;
using Response = Eigen::Matrix<double, 3, ReturnMap::kHandles>;

/// The box on patches in `state`, which goes `stride` [m] along x and turns by `yaw` [rad] in a cycle.
PreparedTarget going(ContactState state, double stride = 0, double yaw = 0, bool loop = true) {
  const BoxCreature creature = make_box_creature();
  PreparedTarget plan;
  plan.target.rate_hz = 30;
  plan.target.loop = loop;
  plan.target.frames = creature.scene.body.rest.reshaped().replicate(1, 60);
  plan.target.travel.x() = stride;
  plan.target.yaw = yaw;
  plan.contacts.patches.resize(1);
  plan.contacts.state = {std::vector<ContactState>(60, state)};
  return plan;
}

/// It takes strides of 2 L, and leaps in a sixth of the cycle or does not.
PreparedTarget striding(bool leaps) {
  PreparedTarget plan = going(ContactState::kStick, 2 * kLength);
  if (leaps) std::fill_n(plan.contacts.state[0].begin(), 10, ContactState::kOff);
  plan.contacts.touching.setConstant(1, 60, true);
  return plan;
}

/// A body that does what a linear return map says.
struct Plant {
  Response response = Response::Zero();
  WayError drift = WayError::Zero(), transient = WayError::Zero(), error = WayError::Zero();
  double stride = 0;  // along x, without turn

  void go(const ReturnMap::Handles& handles, bool first = false) {
    error += WayError(0, 0, -stride * error[0]) + drift + response * handles;
    if (first) error += transient;
  }
  ReturnMap::Answers answers() const {
    ReturnMap::Answers all;
    Plant model = *this;
    model.error.setZero();
    model.go(ReturnMap::trial(0), true);
    all.col(0) = model.error;
    for (int k = 0; k <= ReturnMap::kHandles; ++k) {
      Plant tried = model;
      tried.go(ReturnMap::trial(k));
      all.col(k + 1) = tried.error;
    }
    return all;
  }
};

/// One that turns and slips by up to a few percent of L a cycle, and answers handles as a snake does.
Plant random_plant(unsigned seed, double stride) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> even(-1, 1);
  Plant plant;
  plant.stride = stride;
  for (double& entry : plant.response.reshaped()) entry = 3 * kLength * even(generator);
  plant.response.row(0) /= kLength;
  plant.drift << 0.05 * even(generator), 0.01 * kLength * even(generator), 0.01 * kLength * even(generator);
  plant.transient = 0.5 * plant.drift;
  return plant;
}

double length_of(const WayError& error) { return std::hypot(0.5 * error[0], error[1] / kLength, error[2] / kLength); }

/// The same that drifts by so much, per L, a cycle.
Plant drifting_plant(unsigned seed, double stride, double drift) {
  Plant plant = random_plant(seed, stride);
  plant.drift *= drift / length_of(plant.drift);
  return plant;
}

TEST(ReturnMap, KeepsABodyOnItsWayThatWouldDriftFromItEvenIfItAnswersOtherwiseThanTheModel) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    for (const double stride : {0.0, 0.3 * kLength}) {
      for (const double share : {0.7, 1.0, 1.3}) {
        SCOPED_TRACE("seed " + std::to_string(seed) + " stride " + std::to_string(stride) + " share " +
                     std::to_string(share));
        Plant plant = random_plant(seed, stride), alone = plant;
        ReturnMap map(going(ContactState::kSlide, stride), kLength, make_box_creature().scene.body);
        const ReturnMap::Answers answers = plant.answers();
        plant.response *= share;
        plant.drift = alone.drift = random_plant(seed + 1000, stride).drift;  // friction is not as planned
        double late = 0;
        for (int cycle = 0; cycle < 30; ++cycle) {
          plant.go(map.handles(), cycle == 0);
          alone.go(ReturnMap::Handles::Zero(), cycle == 0);
          map.end_cycle(plant.error);
          if (map.wants_to_learn()) map.learn(answers);
          if (cycle >= 20) late = std::max(late, length_of(plant.error));
        }
        ASSERT_TRUE(map.has_learned());
        EXPECT_LT(late, 0.006);
        EXPECT_LT(late, 0.05 * length_of(alone.error));
      }
    }
  }
}

/// As a frog answers: two handles turn it, each within its bound by up to 0.14 rad a cycle, and set it aside; four hardly do, but could
/// keep both its heading and its place, were they not bounded. It drifts by `turn` [rad] a cycle.
Plant strong_and_weak_plant(unsigned seed, double turn, double stride) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> even(0.8, 1.2);
  Plant plant;
  plant.stride = stride;
  plant.response.row(0) << 4.8, -1.3, 4.4, -0.4, 0.0, -0.4;
  if (stride > 0) plant.response.row(2) << 1.7, -0.3, 1.6, 0.1, 0.1, 0.1;
  plant.response.row(2) *= kLength;
  for (double& entry : plant.response.reshaped()) entry *= even(generator);
  plant.drift[0] = turn;
  return plant;
}

struct Course {
  double late = 0;  // per L, the largest error of cycles 20 to 40
  int rests = 0;    // cycles for which the handles were put to rest
};

/// The plant after it has answered; `share` of its response holds. A push turns it by 0.6 rad in the third cycle, or does not.
Course steered(Plant plant, const PreparedTarget& plan, double share, bool is_pushed) {
  Course course;
  ReturnMap map(plan, kLength, make_box_creature().scene.body);
  const ReturnMap::Answers answers = plant.answers();
  plant.response *= share;
  for (int cycle = 0; cycle < 40; ++cycle) {
    plant.go(map.handles());
    if (is_pushed && cycle == 2) plant.error[0] += 0.6;
    map.end_cycle(plant.error);
    if (cycle == 0) map.learn(answers);
    course.rests += map.handles().isZero(0);
    if (cycle >= 20) course.late = std::max(course.late, length_of(plant.error));
  }
  return course;
}

TEST(ReturnMap, StrongHandlesDoWhatWeakOnesCouldNotWithinTheirBound) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    for (const double turn : {-0.12, 0.12}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " turn " + std::to_string(turn));
      EXPECT_LT(steered(strong_and_weak_plant(seed, turn, 2 * kLength), striding(/*leaps=*/true), 1, false).late, 0.1);
    }
  }
}

TEST(ReturnMap, SteersOnByAResponseThatHoldsByHalf) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    for (const double turn : {-0.2, 0.2}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " turn " + std::to_string(turn));
      Plant plant = strong_and_weak_plant(seed, turn, 0);
      plant.response.row(0) *= 2;
      const Course course = steered(plant, going(ContactState::kSlide), 0.6, false);
      EXPECT_EQ(course.rests, 0);
      EXPECT_LT(course.late, 0.02);
    }
  }
}

TEST(ReturnMap, RecoversItsBoundAfterAPush) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Course course = steered(strong_and_weak_plant(seed, 0.2, 0), going(ContactState::kSlide), 1, true);
    EXPECT_EQ(course.rests, 1);
    EXPECT_LT(course.late, 0.02);
  }
}

TEST(ReturnMap, LeavesAloneWhatIsOnItsWayWasThrownOrIsPlayedOnceAndLegsThatLoseLittle) {
  const physics::Body body = make_box_creature().scene.body;
  const auto wants = [&](const PreparedTarget& plan, const WayError& error) {
    ReturnMap map(plan, kLength, body);
    map.end_cycle(error);
    EXPECT_TRUE(map.handles().isZero(0));
    return map.wants_to_learn();
  };
  const WayError off(0.1, 0.02 * kLength, 0);
  EXPECT_TRUE(wants(going(ContactState::kSlide), off));
  EXPECT_FALSE(wants(going(ContactState::kSlide), 0.02 * off));
  EXPECT_TRUE(wants(going(ContactState::kSlide), 0.2 * off));
  EXPECT_FALSE(wants(going(ContactState::kStick), 0.2 * off));
  EXPECT_TRUE(wants(going(ContactState::kStick), off));
  EXPECT_FALSE(wants(going(ContactState::kStick), 5 * off)) << "what falls or was thrown has nothing to learn";
  EXPECT_FALSE(wants(going(ContactState::kSlide, 0, 0, /*loop=*/false), off));
}

TEST(ReturnMap, LearnsNothingFromAModelThatFallsAndDoesNotAskAgain) {
  const physics::Body body = make_box_creature().scene.body;
  for (const double lost : {10 * kLength, std::numeric_limits<double>::quiet_NaN()}) {
    ReturnMap map(going(ContactState::kSlide), kLength, body);
    map.end_cycle({0.1, 0, 0});
    ReturnMap::Answers answers = random_plant(1, 0).answers();
    answers(1, 4) = lost;
    map.learn(answers);
    map.end_cycle({0.2, 0, 0});
    EXPECT_FALSE(map.has_learned());
    EXPECT_FALSE(map.wants_to_learn());
    EXPECT_TRUE(map.handles().isZero(0));
  }
}

TEST(ReturnMap, LegsWhoseModelKeepsItsWayWereThrownOffIt) {
  for (const ContactState state : {ContactState::kStick, ContactState::kSlide}) {
    for (const double drift : {0.005, 0.02}) {  // per L, a cycle of the model
      SCOPED_TRACE("glides " + std::to_string(state == ContactState::kSlide) + ", drift " + std::to_string(drift));
      for (unsigned seed = 0; seed < 20; ++seed) {
        ReturnMap map(going(state), kLength, make_box_creature().scene.body);
        map.end_cycle({0.1, 0, 0});
        ASSERT_TRUE(map.wants_to_learn());
        map.learn(drifting_plant(seed, 0, drift).answers());
        EXPECT_EQ(map.handles().isZero(0), state == ContactState::kStick && drift < 0.015);
        EXPECT_NE(map.has_learned(), map.handles().isZero(0));
        EXPECT_FALSE(map.wants_to_learn());
      }
    }
  }
}

TEST(ReturnMap, RestsForACycleAfterWhatItDidNotForesee) {
  ReturnMap map(going(ContactState::kSlide), kLength, make_box_creature().scene.body);
  Plant plant = random_plant(3, 0);
  plant.go(map.handles(), true);
  map.end_cycle(plant.error);
  map.learn(plant.answers());
  ASSERT_FALSE(map.handles().isZero(0));
  plant.go(map.handles());
  plant.error[1] += 0.2 * kLength;  // a push
  map.end_cycle(plant.error);
  EXPECT_TRUE(map.handles().isZero(0));
  plant.go(map.handles());
  map.end_cycle(plant.error);
  EXPECT_FALSE(map.handles().isZero(0));
  EXPECT_LE(map.handles().cwiseAbs().maxCoeff(), 0.015 + 1e-12);
}

TEST(ReturnMap, WhatLeapsMayLandFartherFromWhereItWasForeseen) {
  for (const bool leaps : {false, true}) {
    SCOPED_TRACE("leaps " + std::to_string(leaps));
    const PreparedTarget plan = striding(leaps);
    ReturnMap map(plan, kLength, make_box_creature().scene.body);
    Plant plant = drifting_plant(3, 2 * kLength, 0.03);
    plant.go(map.handles(), true);
    map.end_cycle(plant.error);
    map.learn(plant.answers());
    ASSERT_FALSE(map.handles().isZero(0));
    plant.go(map.handles());
    plant.error[1] += 0.2 * kLength;
    map.end_cycle(plant.error);
    EXPECT_EQ(map.handles().isZero(0), !leaps);
    plant.go(map.handles());
    plant.error[1] += 0.5 * kLength;
    map.end_cycle(plant.error);
    EXPECT_TRUE(map.handles().isZero(0));
  }
}

TEST(ReturnMap, BendsNothingForWhatALeapMissesAlongItsWay) {
  for (const bool leaps : {false, true}) {
    SCOPED_TRACE("leaps " + std::to_string(leaps));
    const PreparedTarget plan = striding(leaps);
    const auto handles_after = [&](const Eigen::Vector2d& more) {
      ReturnMap map(plan, kLength, make_box_creature().scene.body);
      Plant plant = drifting_plant(3, 2 * kLength, 0.03);
      plant.go(map.handles(), true);
      map.end_cycle(plant.error);
      map.learn(plant.answers());
      plant.go(map.handles());
      plant.error.tail<2>() += more;
      map.end_cycle(plant.error);
      return map.handles();
    };
    const ReturnMap::Handles usual = handles_after({0, 0});
    EXPECT_EQ((handles_after({0.02 * kLength, 0}) - usual).norm() < 1e-12, leaps);
    EXPECT_GT((handles_after({0, 0.02 * kLength}) - usual).norm(), 1e-4);
  }
}

TEST(ReturnMap, SeesTheErrorFromTheTargetsHeading) {
  const double yaw = 0.4;
  const ReturnMap map(going(ContactState::kSlide, 0, yaw), kLength, make_box_creature().scene.body);
  const auto turned = [](double angle) { return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix(); };
  const Eigen::Vector3d off(0.03, 0.01, -0.02), place(1, 0.2, 2);
  for (const long cycles : {0L, 1L, 5L}) {
    const double heading = yaw * static_cast<double>(cycles);
    const WayError error = map.way_error({turned(0.1), place, place + turned(heading) * off, 0}, cycles);
    EXPECT_LT((error - WayError(0.1, 0.03, -0.02)).norm(), 1e-12) << cycles;
  }
}

TEST(ReturnMap, BendsTheBodySidewaysAndNotWhereCyclesMeet) {
  const BoxCreature creature = make_box_creature();
  const physics::Body& body = creature.scene.body;
  ReturnMap map(going(ContactState::kSlide), kLength, body);
  const auto change = [&](double time_s) {
    Eigen::VectorXd activation = Eigen::VectorXd::Ones(body.edge_count());
    map.apply(time_s, activation);
    return Eigen::VectorXd(activation.array() - 1);
  };
  EXPECT_TRUE(change(0.5 * kPeriod).isZero(0));
  for (int k = 1; k <= ReturnMap::kHandles; ++k) {
    SCOPED_TRACE("handle " + std::to_string(k));
    map.set(ReturnMap::trial(k));
    for (const double met : {0.0, kPeriod, 7 * kPeriod}) EXPECT_LT(change(met).norm(), 1e-12);
    const Eigen::VectorXd bend = change(0.3 * kPeriod);
    EXPECT_GT(bend.norm(), 1e-4);
    EXPECT_LE(bend.cwiseAbs().maxCoeff(), ReturnMap::trial(k).maxCoeff());
    // As much longer on one side as shorter on the other: the box is its own mirror image in the plane z = 0.2.
    double right = 0, left = 0;
    for (int e = 0; e < body.edge_count(); ++e) {
      const double x = (body.rest(0, body.edges(0, e)) + body.rest(0, body.edges(1, e))) / 2;
      const double z = (body.rest(2, body.edges(0, e)) + body.rest(2, body.edges(1, e))) / 2;
      if (x > 0.26 && z > 0.21) right += bend[e];
      if (x > 0.26 && z < 0.19) left += bend[e];
    }
    EXPECT_GT(std::abs(right), 1e-3);
    EXPECT_NEAR(right, -left, 1e-3 * std::abs(right));
  }
}

}  // namespace
}  // namespace hydrostat::retarget::return_map_test

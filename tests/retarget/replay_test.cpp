#include "retarget/replay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "retarget/com_path.h"
#include "retarget/inverse_dynamics.h"
#include "retarget/performance.h"
#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::replay_test {
namespace {

/// A box that knows how to carry `motion` on its four soles.
struct Actor {
  BoxCreature creature = make_box_creature();
  Muscles muscles = make_muscles(creature.scene.body, creature.skeleton, creature.bone_weights);
  PreparedTarget target;
  InverseDynamics inverse;

  explicit Actor(const Motion& motion) {
    target = as_prepared(motion, always_standing(creature, motion.count()));
    inverse = solve_inverse_dynamics(target, creature.scene, BoxCreature::kLength, {});
  }
  Actor() : Actor(standing(make_box_creature(), 6)) {}

  ReplayInput input() const {
    const auto feed_forward = [this](double time, Eigen::VectorXd& activation) {
      const long frame = static_cast<long>(time * target.target.rate_hz);
      activation = inverse.activation.col(target.target.loop ? frame % inverse.activation.cols() : std::min(frame, inverse.activation.cols() - 1));
    };
    return {creature.scene, creature.scene, target, muscles, feed_forward, point_motion(creature.scene.contact_points, target.target),
            creature.scene.contact_points, /*clip_rise=*/0, BoxCreature::kLength, creature.size(), 0.3};
  }
};

ReplayOptions lasting(double seconds, bool correct = true) {
  ReplayOptions options;
  options.duration_s = seconds;
  options.correct = correct;
  options.trace = true;
  return options;
}

TEST(Replay, ABodyThatStandsStaysWhereItIs) {
  const Actor actor;
  for (const bool correct : {false, true}) {
    const Replay result = replay(actor.input(), lasting(1, correct));
    EXPECT_FALSE(result.report.fell) << result.report.fall_cause;
    EXPECT_NEAR(result.report.duration_s, 1, 1e-9);
    EXPECT_NEAR(result.report.cycles, 10, 1e-9);
    EXPECT_LT(result.report.shape_rms_length, 1e-3);
    EXPECT_LT(result.report.world_rms_length, 1e-3);
    EXPECT_LT(std::abs(result.report.drift_per_cycle_length), 1e-4);
    EXPECT_LT(result.report.penetration_max_size, 1e-3);
    EXPECT_LT(result.report.volume_error_max, 1e-2);
    EXPECT_EQ(result.report.inverted_elements, 0);
    EXPECT_EQ(result.report.correction_rms > 0, correct);
  }
}

TEST(Replay, EveryMomentumIsBooked) {
  const BoxCreature creature = make_box_creature();
  const Actor actor(bobbing(creature, 20, 0.05));
  ReplayOptions options = lasting(0.8);
  options.pushes = {{0.2, 0.1, Eigen::Vector3d(0.3, 0, -0.2)}};
  for (const physics::Method method : {physics::Method::kExplicit, physics::Method::kEuler}) {
    SCOPED_TRACE(physics::name_of(method));
    options.method = method;
    const Replay result = replay(actor.input(), options);
    EXPECT_LT(result.report.momentum_residual_mg, 1e-6);
    if (method == physics::Method::kExplicit) {
      EXPECT_LT(result.report.angular_residual_mgl, 1e-6);  // backward Euler turns, and says so
    }
    EXPECT_EQ(result.report.external_assist_mg, 0);
    EXPECT_EQ(result.trace.correction_impulse.norm(), 0);
    // The same from the trace alone, as an audit would.
    const Trace& trace = result.trace;
    const double weight = creature.mass() * 9.81;
    for (Eigen::Index s = 1; s < trace.count(); ++s) {
      const auto sum = [&](const Eigen::MatrixXd& column) { return Eigen::Vector3d(column.col(s).reshaped(3, trace.mass_kg.size()).rowwise().sum()); };
      const auto momentum = [&](Eigen::Index row) { return Eigen::Vector3d(trace.velocity.col(row).reshaped(3, trace.mass_kg.size()) * trace.mass_kg); };
      const double interval = trace.time_s[s] - trace.time_s[s - 1];
      const Eigen::Vector3d missing = (momentum(s) - momentum(s - 1)) / interval - creature.mass() * actor.creature.scene.gravity -
                                      sum(trace.contact_force) - sum(trace.effect_force);
      ASSERT_LT(missing.norm(), 1e-6 * weight) << "row " << s;
    }
  }
}

TEST(Replay, APushGivesItsVelocityToAFreeBody) {
  Actor actor;
  actor.creature.scene.has_ground = false;
  // Durations that are no whole number of steps, one that begins within a step, and two at once.
  const Eigen::Vector3d along(0.5, 0.1, -0.2);
  const std::vector<std::vector<Push>> all = {{{0.02, 0.1, along}}, {{0.02, 0.013, along}}, {{0.0321, 0.0007, along}}, {{0.02, 0.05, 0.25 * along}, {0.03, 0.05, 0.75 * along}}};
  for (std::size_t k = 0; k < all.size(); ++k) {
    SCOPED_TRACE("pushes " + std::to_string(k));
    ReplayOptions options = lasting(0.15, false);
    options.pushes = all[k];
    const Replay result = replay(actor.input(), options);
    const Trace& trace = result.trace;
    const Eigen::Vector3d before = trace.velocity.col(0).reshaped(3, trace.mass_kg.size()) * trace.mass_kg;
    const Eigen::Vector3d after = trace.velocity.col(trace.count() - 1).reshaped(3, trace.mass_kg.size()) * trace.mass_kg;
    const double seconds = trace.time_s[trace.count() - 1];
    EXPECT_LT((after - before - actor.creature.mass() * (along + seconds * actor.creature.scene.gravity)).norm(), 1e-9 * actor.creature.mass());
  }
}

TEST(Replay, AHardShoveIsAFallAndIsTold) {
  const Actor actor;
  ReplayOptions options = lasting(2);
  options.pushes = {{0.2, 0.1, Eigen::Vector3d(0, 2, 12)}};
  const Replay result = replay(actor.input(), options);
  EXPECT_TRUE(result.report.fell);
  EXPECT_GT(result.report.fall_time_s, 0.2);
  EXPECT_LT(result.report.duration_s, 2);
  EXPECT_NE(result.report.fall_cause.find("limb '"), std::string::npos) << result.report.fall_cause;
  EXPECT_NE(result.report.fall_cause.find("limit"), std::string::npos);
  ASSERT_EQ(result.report.fall_cause.find("at "), 0U);
  EXPECT_NEAR(std::stod(result.report.fall_cause.substr(3)), result.report.fall_time_s, 0.02) << "the cause is that of the fall's beginning";
  EXPECT_EQ(result.trace.count(), result.course.time_s.size() + 1);  // nothing is written of what was not simulated
}

TEST(Replay, WhereNoStepLeadsOnThatIsToldAndNoLimb) {
  const Actor actor;
  for (const physics::Method method : {physics::Method::kExplicit, physics::Method::kEuler, physics::Method::kSpring}) {
    SCOPED_TRACE(physics::name_of(method));
    ReplayOptions options = lasting(1);
    options.method = method;
    options.pushes = {{0.1, 0.1, Eigen::Vector3d(1e200, 0, 0)}};  // no number holds the square of such a speed
    const Replay result = replay(actor.input(), options);
    EXPECT_EQ(result.termination, physics::Termination::kDiverged);
    EXPECT_NEAR(result.report.fall_time_s, 0.1, options.step_s);
    EXPECT_TRUE(std::isfinite(result.report.slip_per_stance_length));
    const std::string& cause = result.report.fall_cause;
    EXPECT_TRUE(cause.starts_with("the simulation diverged: at 0.")) << cause;
    for (const std::string& words : {"by the method '" + physics::name_of(method) + "' led to a finite state", std::string(" m/s and 0 elements were inverted")})
      EXPECT_NE(cause.find(words), std::string::npos) << cause;
    for (const char* words : {"limb", "limit", "frame"}) EXPECT_EQ(cause.find(words), std::string::npos) << cause;
  }
}

TEST(Replay, ABodyBelowHalfItsHeightHasFallen) {
  // The target hovers three times as high as the body stands; the body drops.
  Actor actor;
  for (Eigen::Index r = 1; r < actor.target.target.frames.rows(); r += 3) actor.target.target.frames.row(r).array() += 0.8;
  const Replay result = replay(actor.input(), lasting(2, false));
  EXPECT_TRUE(result.report.fell);
  EXPECT_LT(result.course.height[result.course.height.size() - 1], 0.5 * result.course.target_com(1, 0));
}

TEST(Replay, FramesLieAtTheTimesThatTheirRateTells) {
  for (const double rate_hz : {24.0, 30.0, 42 / (17.0 / 24), 60.0, 61.3, 120.0, 240.0}) {
    SCOPED_TRACE("a target of " + std::to_string(rate_hz) + " frames a second");
    Actor actor;
    actor.target.target.rate_hz = rate_hz;
    const Replay result = replay(actor.input(), lasting(0.5, false));
    const Motion& motion = result.motion;
    EXPECT_NEAR(motion.rate_hz / std::min(rate_hz, 120.0), 1, 0.25);
    ASSERT_NEAR(static_cast<double>(motion.count() - 1) / motion.rate_hz, 0.5, 1 / motion.rate_hz);
    for (Eigen::Index f = 0; f < motion.count(); ++f) {
      const double row = static_cast<double>(f) / motion.rate_hz / (result.trace.time_s[1] - result.trace.time_s[0]);
      ASSERT_NEAR(row, std::round(row), 1e-6) << "frame " << f;
      ASSERT_EQ(motion.frames.col(f), result.trace.position.col(std::lround(row))) << "frame " << f;
    }
  }
}

TEST(Replay, IsTheSameEveryTime) {
  const Actor actor;
  ReplayOptions options = lasting(0.4);
  options.pushes = {{0.1, 0.1, Eigen::Vector3d(0.4, 0, 0.1)}};
  const Replay first = replay(actor.input(), options), again = replay(actor.input(), options);
  EXPECT_EQ(first.motion.frames, again.motion.frames);
  EXPECT_EQ(first.trace.velocity, again.trace.velocity);
  EXPECT_EQ(first.trace.activation, again.trace.activation);
  EXPECT_EQ(first.report.shape_rms_length, again.report.shape_rms_length);
}

TEST(Replay, SignalsRunOnBetweenControlSteps) {
  const Actor actor;
  ReplayInput input = actor.input();
  input.feed_forward = [](double time, Eigen::VectorXd& activation) { activation.setConstant(1 + 0.2 * std::sin(40 * time)); };
  ReplayOptions often = lasting(0.2, /*correct=*/false), seldom = often;
  often.steps_per_control = 2;
  seldom.steps_per_control = 8;
  const Trace a = replay(input, often).trace, b = replay(input, seldom).trace;
  ASSERT_EQ(a.position.cols(), 4 * (b.position.cols() - 1) + 1);
  for (Eigen::Index row = 1; row < b.position.cols(); ++row) {
    EXPECT_LT((a.position.col(4 * row) - b.position.col(row)).norm(), 1e-9) << "row " << row;
    EXPECT_NEAR(a.activation.middleCols(4 * row - 3, 4).mean(), b.activation.col(row).mean(), 1e-12) << "row " << row;
  }
}

TEST(Replay, TheCorrectorBringsAPushedBodyBack) {
  const Actor actor;
  ReplayOptions options = lasting(4, true);
  options.pushes = {{0.1, 0.1, Eigen::Vector3d(0.6, 0, 0)}};
  const Replay closed = replay(actor.input(), options);
  options.correct = false;
  const Replay open = replay(actor.input(), options);
  EXPECT_FALSE(closed.report.fell);
  EXPECT_GT(closed.report.correction_rms, 0);
  EXPECT_EQ(open.report.correction_rms, 0);
  const auto off_course = [](const Replay& played) {
    return (played.course.com.rightCols<1>() - played.course.target_com.rightCols<1>()).norm();
  };
  EXPECT_LT(off_course(closed), 0.5 * off_course(open));
}

TEST(Replay, ActivationsStayWithinTheLimit) {
  const Actor actor;
  ReplayOptions options = lasting(0.6);
  options.pushes = {{0.1, 0.1, Eigen::Vector3d(1.5, 0, 1)}};
  const Replay result = replay(actor.input(), options);
  EXPECT_LE(result.trace.activation.maxCoeff(), 1.3);
  EXPECT_GE(result.trace.activation.minCoeff(), 0.7);
}

TEST(Replay, WhatLeapsMakesUpForItsStrength) {
  for (const bool leaps : {false, true}) {
    for (const double stiffness : {0.85, 1.0, 1.2}) {
      SCOPED_TRACE("leaps " + std::to_string(leaps) + ", stiffness " + std::to_string(stiffness));
      Actor actor(standing(make_box_creature(), 20));
      for (std::vector<ContactState>& states : actor.target.contacts.state) {
        if (leaps) std::fill(states.begin() + 8, states.begin() + 13, ContactState::kOff);
      }
      const ReplayInput plan = actor.input();
      const physics::Scene plant = varied_scene(plan.model, {1.1, 1, stiffness});
      const ReplayInput input{plant,           plan.model,          plan.prepared,  plan.muscles, plan.feed_forward,
                              plan.clip_skin, plan.skin_points, plan.clip_rise, plan.length,  plan.size, plan.limit};
      ReplayOptions options = lasting(0.25);
      options.corrector.effort = 1e9;  // the signals alone
      const Eigen::VectorXd rest = Eigen::VectorXd::Ones(plant.body.edge_count());
      const Eigen::VectorXd planned = actor.inverse.activation.col(0) - rest;
      const Eigen::VectorXd commanded = replay(input, options).trace.activation.rightCols<1>() - rest;
      EXPECT_LT((commanded - (leaps ? 1.1 / stiffness : 1) * planned).norm(), 0.01 * planned.norm());
    }
  }
}

TEST(Replay, TravelOfAClipThatStandsInPlaceIsNone) {
  const Replay result = replay(Actor().input(), lasting(0.5));
  EXPECT_LT(std::abs(result.report.travel_per_cycle_length), 1e-3);
  EXPECT_EQ(result.report.clip_travel_per_cycle_length, 0);
  EXPECT_LT(std::abs(result.report.heading_deg_per_cycle), 0.01);
}

TEST(Replay, AReplayThatIsItsClipHasTheSameApex) {
  Actor actor;
  actor.creature.scene.has_ground = false;
  for (const double speed : {0.3, 1.0, 2.0, -1.0}) {  // thrown up, or down
    SCOPED_TRACE("speed " + std::to_string(speed));
    ReplayOptions options = lasting(0.6, false);
    options.pushes = {{0, 0.05, Eigen::Vector3d(0.1, speed, 0)}};
    const Replay first = replay(actor.input(), options);
    Motion clip;
    clip.rate_hz = 120;
    clip.frames = first.trace.position;
    ReplayInput input = actor.input();
    input.clip_rise = apex_rise(com_path(clip, actor.creature.scene.body.mass));
    const ReplayReport report = replay(input, options).report;
    EXPECT_NEAR(report.apex_rise_length, report.clip_apex_rise_length, 1e-12);
    // What was thrown up within 0.05 s, against gravity, flies on as a stone does.
    const double thrown = std::max(0.0, speed - 0.05 * 9.81);
    EXPECT_NEAR(report.apex_rise_length * BoxCreature::kLength, 0.5 * 0.05 * thrown + thrown * thrown / (2 * 9.81), 1e-4);
  }
}

TEST(UsualDuration, IsFifteenCyclesOrTenSecondsAndASecondMoreForAOneShot) {
  Motion motion;
  motion.frames = Eigen::MatrixXd::Zero(3, 30);
  motion.loop = true;
  EXPECT_NEAR(usual_duration(motion), 7.5, 1e-12);  // 15 times 0.5 s
  motion.frames = Eigen::MatrixXd::Zero(3, 90);
  EXPECT_NEAR(usual_duration(motion), 9, 1e-12);    // six whole cycles of 1.5 s
  motion.frames = Eigen::MatrixXd::Zero(3, 900);
  EXPECT_NEAR(usual_duration(motion), 15, 1e-12);   // one cycle at least
  motion.loop = false;
  motion.frames = Eigen::MatrixXd::Zero(3, 61);
  EXPECT_NEAR(usual_duration(motion), 2, 1e-12);
}

}  // namespace
}  // namespace hydrostat::retarget::replay_test

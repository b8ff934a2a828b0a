#include "retarget/polish.h"

#include <gtest/gtest.h>

#include "tests/retarget/box_performer.h"

namespace hydrostat::retarget::polish_test {
namespace {

PerformOptions lasting(double seconds) {
  PerformOptions options;
  options.replay.duration_s = seconds;
  options.baselines = false;
  return options;
}

/// The closed loop of what was polished.
Replay go(Performer performer, const Polished& polished, const PerformOptions& options) {
  performer.path = polished.path;
  return *perform(performer, polished.signals, options).closed_loop;
}

double largest_change(const SignalSet& a, const SignalSet& b) {
  return (signal::stacked_coefficients(a.activation) - signal::stacked_coefficients(b.activation)).cwiseAbs().maxCoeff();
}

/// Signals that are wrong in a few harmonics, as a stiffness that nobody knows would make them.
SignalSet wrong_signals(const Performer& performer) {
  SignalSet signals = signals_of(performer);
  signals.activation.cosine.topRows(3).array() += 0.002;
  signals.activation.sine.row(2).array() -= 0.001;
  return signals;
}

PolishOptions quick() {
  PolishOptions options;
  options.most_rounds = 3;
  options.first_cycles = 6;
  return options;
}

TEST(Polish, TakesOverWhatTheCorrectorDoesInEveryCycle) {
  const Performer performer = make_box_performer();
  const SignalSet signals = wrong_signals(performer);
  PerformOptions options = lasting(1.2);
  const Replay before = *perform(performer, signals, options).closed_loop;
  const Polished polished = polish(performer, signals, options, quick());
  ASSERT_TRUE(polished.is_better());
  const Replay after = go(performer, polished, options);
  EXPECT_LT(after.report.correction_rms, before.report.correction_rms / 3);
  EXPECT_LE(after.report.shape_rms_length, before.report.shape_rms_length + PolishOptions().most_shape);
  EXPECT_EQ(after.report.external_assist_mg, 0);
  EXPECT_LE(after.report.momentum_residual_mg, 1e-6);
  EXPECT_EQ(polished.signals.activation.harmonics(), signals.activation.harmonics());

  // On the path that was learned the signals alone do what they did with the corrector's help.
  options.closed_loop = false;
  const Replay alone_before = *perform(performer, signals, options).open_loop;
  Performer learned = performer;
  learned.path = polished.path;
  const Replay alone = *perform(learned, polished.signals, options).open_loop;
  EXPECT_LT((alone.motion.frames - after.motion.frames).norm(), (alone_before.motion.frames - after.motion.frames).norm() / 3);
}

/// And the same for any layers, to the bit.
TEST(Polish, LearnsUnderTheLayersAndLeavesThem) {
  const Performer performer = make_box_performer();
  const SignalSet plain = wrong_signals(performer);
  SignalSet edited = plain;
  edited.layers.push_back({"calmer", {}, signal::Gain{0.9}});
  const Polished without = polish(performer, plain, lasting(1), quick()), with = polish(performer, edited, lasting(1), quick());
  ASSERT_TRUE(without.is_better());
  EXPECT_TRUE(without.signals.layers.empty());
  ASSERT_EQ(with.signals.layers.size(), 1u);
  EXPECT_EQ(largest_change(with.signals, without.signals), 0);
  EXPECT_TRUE(with.path.place.frames == without.path.place.frames);

  // The penalty forces go with the activations and the lengths that they have become.
  const int e = 5;
  physics::State state;
  NominalPathCurve path(without.path);
  MotionCurve(performer.prepared.target).at(0, state.x, state.v);
  const auto force = [&](const SignalSet& set) {
    const double length = (state.x.col(set.nodes(1, e)) - state.x.col(set.nodes(0, e))).norm();
    return set.stiffness[e] * (length - signal::synthesise(set.activation, 0)[e] * set.rest_length[e]);
  };
  const double before = force(plain);
  path.apply(0, state);
  const double change = force(without.signals) - before;
  const double told = signal::synthesise(without.signals.force, 0)[e] - signal::synthesise(plain.force, 0)[e];
  EXPECT_NEAR(told, change, 0.02 * std::abs(change) + 1e-3);
}

/// What helps the planned body is left out where bodies off the plan stray by it, or fall.
TEST(Polish, IsNotBoughtWithTheBalanceOfOtherBodies) {
  const Performer performer = make_box_performer();
  const SignalSet signals = wrong_signals(performer);
  const PerformOptions options = lasting(1.2);
  const Polished kept = polish(performer, signals, options, quick());
  ASSERT_TRUE(kept.is_better());
  EXPECT_FALSE(kept.is_frail);
  EXPECT_LE(kept.polished_on_trials.lost, kept.solved_on_trials.lost);
  EXPECT_GT(kept.solved_on_trials.shape_rms_length, 0);
  Performer learned = performer;
  learned.path = kept.path;
  const TrialsOutcome of_drawn = go_on_trials(learned, kept.signals, options, PolishOptions().more_trials);
  EXPECT_EQ(kept.polished_on_trials.bodies, 8);
  EXPECT_EQ(kept.polished_on_trials.shape_rms_length, of_drawn.shape_rms_length);
  PolishOptions strict = quick();  // to whom any straying is too much
  strict.most_on_trials = -HUGE_VAL;
  const Polished left = polish(performer, signals, options, strict);
  EXPECT_TRUE(left.is_frail);
  EXPECT_FALSE(left.is_better());
  EXPECT_TRUE(left.path.is_empty());
  EXPECT_EQ(largest_change(left.signals, signals), 0);
  EXPECT_EQ(left.polished_on_trials.bodies, static_cast<int>(kTrials.size())) << "these were enough";
  EXPECT_EQ(left.polished_on_trials.shape_rms_length, go_on_trials(learned, kept.signals, options).shape_rms_length);
}

/// What the corners have nothing against the other bodies may have.
TEST(Polish, IsLeftOutWhereOtherBodiesThanTheCornersStrayByIt) {
  const Performer performer = make_box_performer();
  const SignalSet signals = wrong_signals(performer);
  const PerformOptions options = lasting(1.2);
  PolishOptions far_off = quick();
  far_off.more_trials = {{{1.3, 1, 0.7}, 0.3}, {{1.3, 1, 0.7}, 2}, {{1.3, 1, 0.7}, 4}};
  const Polished kept = polish(performer, signals, options, far_off);
  ASSERT_TRUE(kept.is_better());
  Performer learned = performer;
  learned.path = kept.path;
  const auto least_factor = [&](std::span<const Trial> bodies) {  // that lets it pass
    const double with = go_on_trials(learned, kept.signals, options, bodies).shape_rms_length;
    return (with - far_off.most_shape) / go_on_trials(performer, signals, options, bodies).shape_rms_length;
  };
  const double of_corners = least_factor(kTrials), of_others = least_factor(far_off.more_trials);
  ASSERT_GT(of_others, of_corners + 0.1);
  far_off.most_on_trials = (of_corners + of_others) / 2;
  const Polished left = polish(performer, signals, options, far_off);
  EXPECT_TRUE(left.is_frail);
  EXPECT_EQ(left.polished_on_trials.bodies, 3);
  EXPECT_TRUE(left.path.is_empty());
  EXPECT_EQ(largest_change(left.signals, signals), 0);
  far_off.more_trials.clear();
  EXPECT_TRUE(polish(performer, signals, options, far_off).is_better());
}

TEST(Polish, LeavesWhatFallsAsItWas) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(1.5);
  options.replay.observation.delay_s = 0.1;
  PolishOptions long_enough = quick();
  long_enough.first_cycles = 8;
  ASSERT_TRUE(perform(performer, signals, options).closed_loop->report.fell);
  const Polished polished = polish(performer, signals, options, long_enough);
  EXPECT_FALSE(polished.is_better());
  EXPECT_TRUE(polished.path.is_empty());
  EXPECT_EQ(largest_change(polished.signals, signals), 0);
}

/// What cannot be learned, for it is drawn anew every time, makes nothing worse.
TEST(Polish, NeverEndsWorseThanItBegan) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    PerformOptions options = lasting(0.8);
    options.replay.observation = {0.002 * performer.length, 0, seed};
    const Polished polished = polish(performer, signals, options, quick());
    EXPECT_LE(polished.report.correction_rms_after, polished.report.correction_rms_before);
    if (!polished.is_better()) {
      EXPECT_EQ(largest_change(polished.signals, signals), 0);
    }
  }
}

/// A loop that turns takes its path with it.
TEST(NominalPathCurve, TurnsWithTheLoop) {
  NominalPath path;
  path.place.loop = path.velocity.loop = true;
  path.place.rate_hz = path.velocity.rate_hz = 4;
  path.place.yaw = path.velocity.yaw = 0.3;
  path.place.frames = Eigen::Vector3d(0.1, 0.2, 0).replicate(1, 4);
  path.velocity.frames = Eigen::Vector3d(0, 0, 1).replicate(1, 4);
  NominalPathCurve curve(path);
  for (int period = 0; period < 3; ++period) {
    physics::State state{Eigen::Matrix3Xd::Ones(3, 1), Eigen::Matrix3Xd::Zero(3, 1)};
    curve.apply(period + 0.25, state);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3 * period, Eigen::Vector3d::UnitY()).toRotationMatrix();
    EXPECT_TRUE(state.x.isApprox(Eigen::Vector3d::Ones() + turn * Eigen::Vector3d(0.1, 0.2, 0), 1e-9));
    EXPECT_TRUE(state.v.isApprox(turn * Eigen::Vector3d(0, 0, 1), 1e-9));
  }
  physics::State state{Eigen::Matrix3Xd::Ones(3, 1), Eigen::Matrix3Xd::Zero(3, 1)};
  NominalPathCurve(NominalPath()).apply(0.5, state);
  EXPECT_EQ(state.x, Eigen::Matrix3Xd::Ones(3, 1));
}

}  // namespace
}  // namespace hydrostat::retarget::polish_test

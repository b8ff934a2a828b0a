#include "retarget/performance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <memory>
#include <numbers>
#include <set>
#include <span>

#include "tests/retarget/box_performer.h"

namespace hydrostat::retarget::performance_test {
namespace {

PerformOptions lasting(double seconds) {
  PerformOptions options;
  options.replay.duration_s = seconds;
  return options;
}

TEST(Perform, RunsTheSameBodyThriceWithAndWithoutCorrector) {
  const Performer performer = make_box_performer();
  const Performances runs = perform(performer, signals_of(performer), lasting(0.4));
  ASSERT_TRUE(runs.naive && runs.open_loop && runs.closed_loop);
  EXPECT_EQ(&runs.main(), &*runs.closed_loop);
  EXPECT_EQ(runs.naive->report.correction_rms, 0);
  EXPECT_EQ(runs.open_loop->report.correction_rms, 0);
  EXPECT_GT(runs.closed_loop->report.correction_rms, 0);
  EXPECT_LT(runs.open_loop->report.shape_rms_length, runs.naive->report.shape_rms_length);
  for (const auto& run : {runs.naive, runs.open_loop, runs.closed_loop}) {
    EXPECT_LE(run->report.momentum_residual_mg, 1e-6);
    EXPECT_EQ(run->report.external_assist_mg, 0);
  }
}

TEST(Perform, GivesTheSameForAnyNumberOfThreads) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(0.3);
  options.threads = 1;
  const Performances one = perform(performer, signals, options);
  options.threads = 2;
  const Performances two = perform(performer, signals, options);
  EXPECT_EQ(one.naive->motion.frames, two.naive->motion.frames);
  EXPECT_EQ(one.open_loop->motion.frames, two.open_loop->motion.frames);
  EXPECT_EQ(one.closed_loop->motion.frames, two.closed_loop->motion.frames);
}

TEST(Perform, RunsOnlyWhatIsWanted) {
  const Performer performer = make_box_performer();
  PerformOptions options = lasting(0.1);
  options.baselines = false;
  options.replay.trace = true;
  const Performances closed = perform(performer, signals_of(performer), options);
  EXPECT_FALSE(closed.naive || closed.open_loop);
  EXPECT_EQ(closed.main().trace.count(), 13);
  options.closed_loop = false;
  const Performances open = perform(performer, signals_of(performer), options);
  EXPECT_FALSE(open.naive || open.closed_loop);
  EXPECT_EQ(&open.main(), &*open.open_loop);
  EXPECT_EQ(open.main().report.correction_rms, 0);
}

const std::vector<Feedback> kInTurn{{1, 1, 1, 1e-3}, {1, 1, 1, 1e-2}, {1, 1, 1, 1}, {1, 0.6, 4.0 / 3}, {1, 0.5, 10.0 / 3}, {4, 1, 1}, {16, 1, 1}, {64, 1, 1}};

Performances perform_by(const Feedback& feedback, const Performer& performer, const SignalSet& signals, PerformOptions options) {
  options.feedback = feedback;
  options.baselines = false;
  return perform(performer, signals, options);
}

bool is_lost_by(const Feedback& feedback, const Performer& performer, const SignalSet& signals, const PerformOptions& options) {
  return lapse_of(performer, options.replay, perform_by(feedback, performer, signals, options).main()) != Lapse::kNothing;
}

TEST(Feedback, IsFactorsOnTheCorrectorsOptions) {
  CorrectorOptions options;
  options.effort = 2, options.horizon_s = 0.05, options.root_weight = 4;
  const CorrectorOptions other = with({3, 0.5, 1.5, 0.01}, options), same = with({}, options);
  EXPECT_DOUBLE_EQ(other.effort, 6);
  EXPECT_DOUBLE_EQ(other.horizon_s, 0.025);
  EXPECT_DOUBLE_EQ(other.root_weight, 6);
  EXPECT_EQ(other.settle_s, options.settle_s);
  EXPECT_EQ(other.regulator.reach, 0.01);
  EXPECT_EQ(same.regulator.reach, 0);
  EXPECT_EQ(same.effort, 2);
  EXPECT_EQ(same.horizon_s, 0.05);
  EXPECT_EQ(same.root_weight, 4);
}

TEST(PerformSteadily, KeepsWhatWasWishedWhereThatWillDo) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  for (const Feedback& wished : {Feedback(), Feedback{2, 1, 1}}) {
    PerformOptions options = lasting(0.5);
    options.feedback = wished;
    const Performances runs = perform_steadily(performer, signals, options);
    EXPECT_EQ(runs.feedback, wished);
    EXPECT_EQ(runs.wished_lapse, Lapse::kNothing);
    EXPECT_TRUE(runs.main().motion.frames == perform_by(wished, performer, signals, options).main().motion.frames);
  }
}

/// Feedback that is too eager for how late it knows shakes the body down. What keeps the planned body up may still lose others: the
/// search goes on until something keeps them all.
TEST(PerformSteadily, TakesWhatKeepsUpThePlannedBodyAndMostOfThoseOffThePlan) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(2);
  options.is_thorough = true;
  options.replay.observation.delay_s = 0.105;
  const auto loses_by = [&](const Feedback& feedback) { return is_lost_by(feedback, performer, signals, options); };
  const auto trials_lost_by = [&](const Feedback& feedback) {
    PerformOptions by = options;
    by.feedback = feedback;
    return go_on_trials(performer, signals, by).lost;
  };
  ASSERT_TRUE(loses_by({}));
  const Performances steady = perform_steadily(performer, signals, options);
  const auto taken = std::find(kInTurn.begin(), kInTurn.end(), steady.feedback);
  ASSERT_NE(taken, kInTurn.end());
  EXPECT_EQ(steady.trials_lost, trials_lost_by(*taken));
  int refused = 0;
  std::for_each(kInTurn.begin(), taken, [&](const Feedback& feedback) {
    if (loses_by(feedback)) return;
    EXPECT_GT(trials_lost_by(feedback), steady.trials_lost);
    ++refused;
  });
  EXPECT_GE(refused, 1) << "the trials decided nothing";
  EXPECT_EQ(steady.wished_lapse, Lapse::kFell);
  EXPECT_EQ(steady.lapse, Lapse::kNothing);
  EXPECT_TRUE(steady.naive && steady.open_loop);
  EXPECT_TRUE(steady.main().motion.frames == perform_by(*taken, performer, signals, options).main().motion.frames);
}

/// On two points the usual gain keeps the planned body up for a while and loses those that are shoved; a regulator keeps more.
TEST(PerformSteadily, TakesARegulatorWhereThePlannedBodyIsWellAndThoseOffThePlanAreNot) {
  const Performer performer = make_box_performer(12, make_tiptoe_box());
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(1.5);
  ASSERT_FALSE(is_lost_by({}, performer, signals, options));
  const int lost = go_on_trials(performer, signals, options).lost;
  ASSERT_GT(lost, 0);
  EXPECT_EQ(perform_steadily(performer, signals, options).feedback, Feedback()) << "a level of detail has no time for trials";

  options.is_thorough = true;
  const Performances steady = perform_steadily(performer, signals, options);
  EXPECT_GT(steady.feedback.regulator, 0);
  EXPECT_LT(steady.trials_lost, lost);
  for (const Feedback& feedback : kInTurn) {
    if (feedback.regulator == 0) continue;
    PerformOptions by = options;
    by.feedback = feedback;
    EXPECT_GE(go_on_trials(performer, signals, by).lost, steady.trials_lost) << "reach " << feedback.regulator;
  }
  EXPECT_EQ(steady.wished_lapse, Lapse::kNothing);
  EXPECT_EQ(steady.lapse, Lapse::kNothing);
  EXPECT_TRUE(steady.naive && steady.open_loop);
  EXPECT_TRUE(steady.main().motion.frames == perform_by(steady.feedback, performer, signals, options).main().motion.frames);
}

/// What sees late and acts at once on all that it sees shakes down light and stiff bodies, on which it has most of a hold, and no heavy ones.
TEST(PerformSteadily, TakesAnotherRegulatorWhereLightBodiesAloneAreLost) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(1);
  options.is_thorough = true;
  options.replay.observation.delay_s = 0.02;
  options.feedback.regulator = 1;
  ASSERT_FALSE(is_lost_by(options.feedback, performer, signals, options));
  ASSERT_EQ(go_on_trials(performer, signals, options, std::span(kTrials).first(2)).lost, 0);
  ASSERT_EQ(go_on_trials(performer, signals, options, std::span(kTrials).last(2)).lost, 2);
  const Performances steady = perform_steadily(performer, signals, options);
  EXPECT_NE(steady.feedback, options.feedback);
  EXPECT_EQ(steady.trials_lost, 0);
  options.feedback = steady.feedback;
  EXPECT_EQ(go_on_trials(performer, signals, options).lost, 0);
}

/// A run by the performer's signals that knows of no other.
Replay run_alone(const Performer& performer, const SignalSet& signals, const physics::Scene& plant, ReplayOptions options,
                 const Feedback& feedback) {
  options.corrector = with(feedback, options.corrector);
  const auto player = std::make_shared<signal::Synthesiser>(activations(signals));
  const auto play = [player](double time_s, Eigen::VectorXd& activation) { player->at(time_s, activation); };
  return replay({plant, performer.scene, performer.prepared, performer.muscles, play, performer.clip_points, performer.scene.contact_points,
                 performer.clip_rise, performer.length, performer.size, signals.limit, &performer.path},
                options);
}

int trials_lost_alone(const Performer& performer, const SignalSet& signals, const ReplayOptions& options, const Feedback& feedback) {
  return static_cast<int>(std::count_if(kTrials.begin(), kTrials.end(), [&](const Trial& trial) {
    ReplayOptions shoved = options;
    shoved.pushes.push_back({.delta_v = kTrialShove * Eigen::Vector3d(std::cos(trial.angle), 0, std::sin(trial.angle))});
    const Replay run = run_alone(performer, signals, varied_scene(performer.scene, trial.body), shoved, feedback);
    return lapse_of(performer, options, run) != Lapse::kNothing;
  }));
}

/// Three regulators may be tried on five bodies, two of them side by side.
TEST(PerformSteadily, FindsTheCostToGoOnceAndGoesByItAsEachRunDoesByItsOwn) {
  const Performer performer = make_box_performer(12, make_tiptoe_box());
  const SignalSet signals = signals_of(performer);
  int regulated = 0;
  for (const double seconds : {1.5, 2.5}) {  // the planned body is well; it falls
    SCOPED_TRACE(seconds);
    PerformOptions options = lasting(seconds);
    options.baselines = false;
    const Act usual(performer, signals), searched(performer, signals);
    perform_steadily(usual, options);
    EXPECT_EQ(usual.costs_found(), 0) << "no regulator was tried";

    options.is_thorough = true;
    const Performances steady = perform_steadily(searched, options);
    EXPECT_EQ(searched.costs_found(), 1);
    if (steady.feedback.regulator > 0) ++regulated;
    EXPECT_EQ(steady.main().motion.frames, run_alone(performer, signals, performer.scene, options.replay, steady.feedback).motion.frames);
    EXPECT_EQ(steady.trials_lost, trials_lost_alone(performer, signals, options.replay, steady.feedback));
  }
  EXPECT_GE(regulated, 1) << "nothing went by what was found";
}

/// Bodies that are pushed off their way, whoever of them asks first.
TEST(Act, AsksItsModelOnceHowToSteerAndGoesAsEachBodyDoesByItself) {
  Performer performer = make_box_performer();
  performer.scene.ground.friction = 0.1;  // it slides on for cycles
  const SignalSet signals = signals_of(performer);
  const physics::Scene heavy = varied_scene(performer.scene, {1.1, 1, 1});
  ReplayOptions options = lasting(4 * performer.prepared.target.duration_s()).replay;
  const auto pushed = [&](double speed) {
    ReplayOptions by_push = options;
    by_push.pushes.push_back({.delta_v = {speed, 0, 0}});
    return by_push;
  };
  const Act act(performer, signals);
  const Replay first = act.run(heavy, pushed(0.3)), second = act.run(performer.scene, pushed(0.4));
  EXPECT_EQ(act.times_asked(), 1);
  EXPECT_EQ(first.motion.frames, Act(performer, signals).run(heavy, pushed(0.3)).motion.frames);
  const Act anew(performer, signals), side_by_side(performer, signals);
  EXPECT_EQ(second.motion.frames, anew.run(performer.scene, pushed(0.4)).motion.frames);
  EXPECT_EQ(anew.times_asked(), 1) << "it wants to know, too";
  auto beside = std::async(std::launch::async, [&] { return side_by_side.run(heavy, pushed(0.3)); });
  EXPECT_EQ(side_by_side.run(performer.scene, pushed(0.4)).motion.frames, second.motion.frames);
  EXPECT_EQ(beside.get().motion.frames, first.motion.frames);
  EXPECT_EQ(side_by_side.times_asked(), 1);
  options.corrector.effort *= 2;
  EXPECT_EQ(act.run(heavy, pushed(0.3)).motion.frames, Act(performer, signals).run(heavy, pushed(0.3)).motion.frames);
  EXPECT_EQ(act.times_asked(), 2) << "by other feedback the model goes otherwise";
  options.keep_way = false;
  options.corrector.horizon_s *= 2;
  act.run(heavy, pushed(0.3));
  EXPECT_EQ(act.times_asked(), 2) << "nobody wants to know";
}

/// Whichever of its bodies went first.
TEST(Act, GoesByTheCostToGoOfItsPlanOnWhateverBody) {
  const Performer plain = make_box_performer();
  Performer performer = plain;
  performer.scene.obstacles.push_back({.shape = physics::Ball{0.1}, .place = {5, 0, 0}});  // which no model knows
  const SignalSet signals = signals_of(performer);
  ReplayOptions options = lasting(0.3).replay;
  options.corrector = with({.regulator = 1}, options.corrector);
  const Act act(performer, signals);
  const physics::Scene light = varied_scene(performer.scene, {0.8, 1, 1.2});
  const Replay of_light = act.run(light, options), of_plan = act.run(performer.scene, options);
  EXPECT_EQ(of_light.motion.frames, run_alone(plain, signals, light, options, {}).motion.frames);
  EXPECT_EQ(of_plan.motion.frames, run_alone(plain, signals, performer.scene, options, {}).motion.frames);
  EXPECT_NE(of_light.motion.frames, of_plan.motion.frames);
  EXPECT_EQ(act.costs_found(), 1);
  options.steps_per_control *= 2;
  EXPECT_EQ(act.run(light, options).motion.frames, run_alone(plain, signals, light, options, {}).motion.frames);
  EXPECT_EQ(act.costs_found(), 2) << "another control step is another cost";
  act.run_naively(light, lasting(0.1).replay);
  EXPECT_EQ(act.costs_found(), 2);
}

/// A level of detail has no time for trials, nor for regulators.
TEST(PerformSteadily, TakesTheFirstGainThatStaysUpWhereItIsNotThorough) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(1.5);
  options.replay.observation.delay_s = 0.09;
  const auto is_passed = [&](const Feedback& feedback) { return feedback.regulator > 0 || is_lost_by(feedback, performer, signals, options); };
  const Performances steady = perform_steadily(performer, signals, options);
  EXPECT_EQ(steady.wished_lapse, Lapse::kFell);
  EXPECT_EQ(steady.lapse, Lapse::kNothing);
  EXPECT_EQ(steady.feedback, *std::find_if_not(kInTurn.begin(), kInTurn.end(), is_passed));
  EXPECT_EQ(steady.trials_lost, 0);
}

/// And where their number goes by four, from where none of the corners is.
TEST(DrawnTrials, LieWithinTheBoundsAndAreShovedFromSidesOfTheirOwn) {
  const auto sides_apart = [](const Trial& a, const Trial& b) { return std::abs(std::remainder(a.angle - b.angle, 2 * std::numbers::pi)); };
  for (const int count : {2, 4, 8, 12}) {
    SCOPED_TRACE(count);
    const std::vector<Trial> drawn = drawn_trials(count), others = drawn_trials(count, 7);
    ASSERT_EQ(drawn.size(), static_cast<std::size_t>(count));
    std::set<double> seen;
    for (std::size_t k = 0; k < drawn.size(); ++k) {
      for (const double factor : {drawn[k].body.mass, drawn[k].body.friction, drawn[k].body.stiffness}) {
        EXPECT_LT(std::abs(factor - 1), kTrialVariation);
        EXPECT_TRUE(seen.insert(factor).second) << "twice the same";
      }
      EXPECT_EQ(drawn[k].body.mass, drawn_trials(count)[k].body.mass);
      EXPECT_NE(drawn[k].body.mass, others[k].body.mass);
      for (std::size_t other = 0; other < k; ++other) EXPECT_GT(sides_apart(drawn[k], drawn[other]), 0.99 * 2 * std::numbers::pi / count);
      if (count % 4 == 0) {
        for (const Trial& corner : kTrials) EXPECT_GT(sides_apart(drawn[k], corner), 0.99 * std::numbers::pi / count);
      }
    }
  }
  EXPECT_TRUE(drawn_trials(0).empty());
}

/// A box that nothing disturbs stands on whatever body; by feedback that knows too late none of them does.
TEST(CountTrialsLost, IsNoneOfWhatStandsAndAllOfWhatFalls) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(1);
  EXPECT_EQ(go_on_trials(performer, signals, options).lost, 0);
  options.threads = 1;
  options.feedback = {1, 0.5, 10.0 / 3};
  options.replay.observation.delay_s = 0.09;
  options.replay.duration_s = 1.5;
  const int lost = go_on_trials(performer, signals, options).lost;
  EXPECT_EQ(lost, static_cast<int>(kTrials.size()));
  options.threads = 2;
  EXPECT_EQ(go_on_trials(performer, signals, options).lost, lost);
}

/// As many bodies as are wanted, one by one as in pairs.
TEST(CountTrialsLost, TakesAnyNumberOfBodies) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  const auto shape = [&](std::size_t first, std::size_t count) {
    const TrialsOutcome outcome = go_on_trials(performer, signals, lasting(0.3), std::span(kTrials).subspan(first, count));
    EXPECT_EQ(outcome.bodies, static_cast<int>(count));
    return outcome.shape_rms_length;
  };
  const double first = shape(0, 1);
  EXPECT_GT(first, 0);
  EXPECT_NEAR(shape(0, 3), (first + 2 * shape(1, 2)) / 3, 1e-15);
  EXPECT_EQ(shape(0, 0), 0);
}

/// A single run of a body off the plan may end a little beside its place, but not by over a twentieth of L, as what is shoved on ice.
TEST(CountTrialsLost, IsAllOfWhatIsPlayedOnceAndEndsFarOff) {
  Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  performer.prepared.target.loop = false;
  EXPECT_EQ(go_on_trials(performer, signals, lasting(0.35)).lost, 0);
  performer.scene.ground.friction = 0.005;
  EXPECT_EQ(go_on_trials(performer, signals, lasting(0.35)).lost, static_cast<int>(kTrials.size()));
}

/// The box as it glides over ground that hardly holds it, so far that gains differ in how far.
Performer make_gliding_performer() {
  constexpr double kWay = 0.1;  // [m] a period
  Performer performer = make_box_performer();
  Motion& target = performer.prepared.target;
  target.travel = Eigen::Vector3d(kWay, 0, 0);
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    target.at(f).row(0).array() += kWay * static_cast<double>(f) / static_cast<double>(target.count());
  }
  performer.scene.ground.friction = 0.1;
  performer.clip_points = point_motion(performer.scene.contact_points, target);
  return performer;
}

/// The clip's way [per L] that a run which comes to `keeps` keeps, and one that comes to `loses` does not.
double way_between(double keeps, double loses) { return (keeps + loses) / 2 / (keeps > loses ? 0.92 : 1.08); }

TEST(PerformSteadily, TakesAnotherGainWhereTheWishedOneLosesItsWay) {
  Performer performer = make_gliding_performer();
  const SignalSet signals = signals_of(performer);
  const PerformOptions options = lasting(0.6);  // three cycles, too few to tell drift
  const Performances usual = perform_by({}, performer, signals, options), quick = perform_by(kInTurn[3], performer, signals, options);
  const double near = usual.main().report.travel_per_cycle_length, far = quick.main().report.travel_per_cycle_length;
  ASSERT_NE(near, far);

  performer.clip_points.travel.x() = performer.length * way_between(far, near);
  const Performances steady = perform_steadily(performer, signals, options);
  EXPECT_EQ(steady.feedback, kInTurn[3]);
  EXPECT_EQ(steady.wished_lapse, Lapse::kLostWay);
  EXPECT_EQ(steady.lapse, Lapse::kNothing);
  EXPECT_TRUE(steady.main().motion.frames == quick.main().motion.frames);
  EXPECT_TRUE(steady.naive && steady.open_loop);
  PerformOptions pushed = options;
  pushed.replay.pushes.emplace_back();
  EXPECT_EQ(perform_steadily(performer, signals, pushed).feedback, Feedback()) << "no way is planned for what is pushed";

  performer.clip_points.travel.x() = performer.length * way_between(near, far);
  EXPECT_EQ(perform_steadily(performer, signals, options).feedback, Feedback()) << "the usual gain keeps the way";

  performer.clip_points.travel.x() = 10 * performer.length * std::max(near, far);
  const Performances lost = perform_steadily(performer, signals, options);
  EXPECT_EQ(lost.feedback, Feedback()) << "on no gain it comes so far";
  EXPECT_EQ(lost.lapse, Lapse::kLostWay);
  EXPECT_TRUE(lost.main().motion.frames == usual.main().motion.frames);
}

/// Three cycles, on which it makes `share` of its way.
Replay way_made(double share, double way = 0.5) {
  Replay run;
  run.report.cycles = 3;
  run.report.clip_travel_per_cycle_length = way;
  run.report.travel_per_cycle_length = share * way;
  return run;
}

TEST(LapseOf, IsAFallOrTravelThatIsOverEightOrDriftOverFourPerCentOfTheWay) {
  const Performer performer = make_box_performer();
  for (const double share : {0.93, 1.0, 1.07}) EXPECT_EQ(lapse_of(performer, {}, way_made(share)), Lapse::kNothing) << share;
  for (const double share : {-1.0, 0.0, 0.91, 1.09}) EXPECT_EQ(lapse_of(performer, {}, way_made(share)), Lapse::kLostWay) << share;
  Replay fallen = way_made(0), diverged = way_made(1);
  fallen.report.fell = true;
  diverged.termination = physics::Termination::kDiverged;
  Replay veering = way_made(1), drifting = way_made(1);
  veering.report.drift_per_cycle_length = 0.019;
  drifting.report.drift_per_cycle_length = 0.021;
  for (Replay* run : {&veering, &drifting}) run->report.cycles = 4;
  EXPECT_EQ(lapse_of(performer, {}, veering), Lapse::kNothing);
  EXPECT_EQ(lapse_of(performer, {}, drifting), Lapse::kLostWay);
  EXPECT_EQ(lapse_of(performer, {}, fallen), Lapse::kFell);
  EXPECT_EQ(lapse_of(performer, {}, diverged), Lapse::kFell);
}

/// What travels has its way for that, and may be ahead or behind.
TEST(LapseOf, OfWhatStaysIsAPlaceThatIsOffByOverAFewPerCentOfLength) {
  const Performer performer = make_box_performer();
  const auto off = [](double way, double place, double shape) {
    Replay run = way_made(1, way);
    run.report.world_rms_length = std::hypot(place, shape);
    run.report.shape_rms_length = shape;
    return run;
  };
  for (const double way : {0.0, 0.049}) {
    for (const double shape : {0.0, 0.02, 0.3}) {
      EXPECT_EQ(lapse_of(performer, {}, off(way, 0.049, shape)), Lapse::kNothing) << way << ", " << shape;
      EXPECT_EQ(lapse_of(performer, {}, off(way, 0.051, shape)), Lapse::kLostWay) << way << ", " << shape;
    }
  }
  EXPECT_EQ(lapse_of(performer, {}, off(0.051, 0.5, 0)), Lapse::kNothing);
  Performer in_scene = performer;
  in_scene.world.decisions.emplace_back();
  EXPECT_EQ(lapse_of(in_scene, {}, off(0, 0.5, 0)), Lapse::kNothing) << "a scene";
}

/// What is played once ends somewhere, and whatever comes next begins there; a loop that turns drifts.
TEST(LapseOf, OfWhatIsPlayedOnceIsATurnAtItsEnd) {
  Performer once = make_box_performer();
  const Performer loop = once;
  once.prepared.target.loop = false;
  for (const double way : {0.0, 0.5}) {
    for (const double sign : {-1.0, 1.0}) {
      Replay run = way_made(1, way);
      run.report.heading_deg_per_cycle = sign * 0.29;
      EXPECT_EQ(lapse_of(once, {}, run), Lapse::kNothing) << way << ", " << sign;
      run.report.heading_deg_per_cycle = sign * 0.31;
      EXPECT_EQ(lapse_of(once, {}, run), Lapse::kLostWay) << way << ", " << sign;
      EXPECT_EQ(lapse_of(loop, {}, run), Lapse::kNothing) << way << ", " << sign;
    }
  }
}

TEST(LapseOf, AsksForNoWayWhereNoneIsPlannedOrNoneWasGone) {
  const Replay lost = way_made(0.5);
  const Performer plain = make_box_performer();
  ASSERT_EQ(lapse_of(plain, {}, lost), Lapse::kLostWay);
  EXPECT_EQ(lapse_of(plain, {}, way_made(0.5, 0.04)), Lapse::kNothing) << "it hardly travels";
  Replay brief = lost;
  brief.report.cycles = 0.9;
  EXPECT_EQ(lapse_of(plain, {}, brief), Lapse::kNothing) << "less than a cycle";
  Replay drifting = way_made(1);
  drifting.report.drift_per_cycle_length = 0.1;
  EXPECT_EQ(lapse_of(plain, {}, drifting), Lapse::kNothing) << "too few cycles to tell the drift";
  ReplayOptions pushed;
  pushed.pushes.emplace_back();
  EXPECT_EQ(lapse_of(plain, pushed, lost), Lapse::kNothing) << "a push";
  Performer turning = plain, in_scene = plain, among_obstacles = plain, on_slope = plain;
  turning.prepared.target.yaw = 0.1;
  EXPECT_EQ(lapse_of(turning, {}, lost), Lapse::kNothing) << "a circle";
  drifting.report.cycles = 4;
  EXPECT_EQ(lapse_of(turning, {}, drifting), Lapse::kLostWay) << "out of the circle";
  in_scene.world.decisions.emplace_back();
  EXPECT_EQ(lapse_of(in_scene, {}, lost), Lapse::kNothing) << "a scene";
  among_obstacles.scene.obstacles.emplace_back();
  EXPECT_EQ(lapse_of(among_obstacles, {}, lost), Lapse::kNothing) << "an obstacle";
  on_slope.scene.gravity.x() = 1;
  EXPECT_EQ(lapse_of(on_slope, {}, lost), Lapse::kNothing) << "a slope";
}

TEST(VariationOf, IsNothingForSeed0AndWithinTwoPerCentForOthers) {
  EXPECT_EQ(variation_of(0).mass, 1);
  EXPECT_EQ(variation_of(0).friction, 1);
  EXPECT_EQ(variation_of(0).stiffness, 1);
  double heaviest = 0, lightest = 2;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Variation variation = variation_of(seed);
    for (const double factor : {variation.mass, variation.friction, variation.stiffness}) EXPECT_NEAR(factor, 1, 0.02);
    EXPECT_NE(variation.mass, variation.stiffness);
    heaviest = std::max(heaviest, variation.mass);
    lightest = std::min(lightest, variation.mass);
  }
  EXPECT_GT(heaviest, 1.018);
  EXPECT_LT(lightest, 0.982);
}

TEST(VariedScene, ScalesMassFrictionAndStiffnessAlone) {
  const physics::Scene scene = make_box_creature().scene;
  const physics::Scene varied = varied_scene(scene, {1.01, 0.99, 1.02});
  EXPECT_TRUE(varied.body.mass.isApprox(1.01 * scene.body.mass));
  EXPECT_DOUBLE_EQ(varied.ground.friction, 0.99 * scene.ground.friction);
  EXPECT_TRUE(varied.body.edge_stiffness.isApprox(1.02 * scene.body.edge_stiffness));
  EXPECT_TRUE(varied.body.volume_stiffness.isApprox(1.02 * scene.body.volume_stiffness));
  EXPECT_EQ(varied.body.rest_length, scene.body.rest_length);
}

TEST(VariedScene, ScalesTheForcesOfElementsToo) {
  for (const BoxCreature& creature : element_box_creatures()) {
    const physics::Scene varied = varied_scene(creature.scene, {1.01, 1, 1.02}), same = varied_scene(creature.scene, {});
    const physics::PointsOf<3> x = Eigen::Vector3d(1.1, 0.95, 1.02).asDiagonal() * creature.scene.body.rest;
    const auto force_of = [&](const physics::Scene& scene) {
      physics::PointsOf<3> force = physics::PointsOf<3>::Zero(3, x.cols());
      physics::InternalForces<3>(scene.body).add_elastic_forces(x, force);
      return force;
    };
    EXPECT_TRUE(force_of(varied).isApprox(1.02 * force_of(creature.scene)));
    EXPECT_EQ(force_of(same), force_of(creature.scene));
  }
}

TEST(SubstepError, IsSmallAndShrinksWithTheStep) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  ReplayOptions options;
  const double error = substep_error(performer, signals, options);
  EXPECT_GT(error, 0);
  EXPECT_LT(error, 1e-3);
  options.step_s /= 16;
  options.steps_per_control *= 16;
  EXPECT_LT(substep_error(performer, signals, options), error);
}

}  // namespace
}  // namespace hydrostat::retarget::performance_test

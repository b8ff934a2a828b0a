#include "retarget/performance.h"

#include <gtest/gtest.h>

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

/// Feedback that is too eager for how late it knows shakes the body down: the search ends at the first effort that does not.
TEST(PerformCalmly, TakesTheFirstEffortThatStaysUp) {
  const Performer performer = make_box_performer();
  const SignalSet signals = signals_of(performer);
  PerformOptions options = lasting(1.5);
  EXPECT_EQ(perform_calmly(performer, signals, options).effort, 1);
  const auto falls = [](const Performances& runs) { return runs.main().report.fell; };
  options.replay.observation.delay_s = 0.1;
  ASSERT_TRUE(falls(perform(performer, signals, options)));
  const Performances calm = perform_calmly(performer, signals, options);
  EXPECT_FALSE(falls(calm));
  EXPECT_GT(calm.effort, 1);
  EXPECT_TRUE(calm.naive && calm.open_loop);
  options.replay.corrector.effort *= calm.effort / 4;
  EXPECT_TRUE(falls(perform(performer, signals, options)));
  options.replay.corrector.effort *= 4;
  EXPECT_TRUE(calm.main().motion.frames == perform(performer, signals, options).main().motion.frames);
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

#include <gtest/gtest.h>

#include <cmath>

#include "physics/system_matrix.h"
#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics::explicit_test {
namespace {

constexpr double kDt = 1.0 / 240;

template <int Dim>
StateOf<Dim> tumbling(const BodyOf<Dim>& body, unsigned seed) {
  std::mt19937 random(seed);
  return {body.rest, rigid_velocity<Dim>(body, body.rest, vec<Dim>(1, 2, 0), random_spin<Dim>(random, 6))};
}

template <typename Dimension>
class Explicit : public testing::Test {};
TYPED_TEST_SUITE(Explicit, SimulatedDimensions, DimensionName);

TYPED_TEST(Explicit, KeepsAngularMomentumInFreeFlightWhateverTheActivation) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(6u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const SceneOf<Dim> scene = in_the_air(random_body<Dim>(seed), seed % 2 == 0);
    const BodyOf<Dim>& body = scene.body;
    const std::unique_ptr<StepperOf<Dim>> stepper = make_explicit_stepper(scene);
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state = tumbling<Dim>(body, seed);
    const auto spin = [&]() -> SpinOf<Dim> {
      return angular_momentum(body, state.x, state.v, centre_of_mass(body, state.x));
    };
    const SpinOf<Dim> at_first = spin();
    for (int k = 0; k < few_steps(240); ++k) {
      const Eigen::VectorXd activation = random_activation(random, body, 0.2);
      ASSERT_EQ(stepper->step(kDt, activation, nullptr, state, impulses), Termination::kDone);
    }
    EXPECT_LT((spin() - at_first).norm(), 1e-9 * at_first.norm());
  }
}

TYPED_TEST(Explicit, ConvergesWithTheStepInFreeFlight) {
  constexpr int Dim = TypeParam::kDim;
  const SceneOf<Dim> scene = in_the_air(bar<Dim>(3, 2, 2, 0.1), true);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_explicit_stepper(scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  std::mt19937 random(1);
  const Eigen::VectorXd activation = random_activation(random, scene.body, 0.1);
  const double coarse = stepper->substep(kDt);
  const auto after_a_tenth_second = [&](int halvings) {
    StateOf<Dim> state = tumbling<Dim>(scene.body, 1);
    const double h = coarse / std::exp2(halvings);
    const auto steps = static_cast<int>(std::round(0.1 / coarse)) << halvings;
    for (int k = 0; k < few_steps(steps); ++k) stepper->step(h, activation, nullptr, state, impulses);
    return state.x;
  };
  const PointsOf<Dim> reference = after_a_tenth_second(6);
  double last = (after_a_tenth_second(0) - reference).norm();
  for (int halvings = 1; halvings < 4; ++halvings) {
    const double error = (after_a_tenth_second(halvings) - reference).norm();
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_GT(std::log2(last / error), 0.9) << halvings << " halvings";
    last = error;
  }
}

TYPED_TEST(Explicit, StaysStableUnderSuddenActivationOfFortyPercentAndOfTwentyWithoutDamping) {
  constexpr int Dim = TypeParam::kDim;
  for (const double damping_time : {0.0, 0.002, 0.01}) {
    for (const double activation : {0.6, 0.8, 1.0, 1.2, 1.4}) {
      if (damping_time == 0 && std::abs(activation - 1) > 0.3) continue;
      SCOPED_TRACE("damping " + std::to_string(damping_time) + " s, activation " + std::to_string(activation));
      Material material;
      material.damping_time = damping_time;
      const SceneOf<Dim> scene = in_the_air(bar<Dim>(4, 2, 2, 0.1, material), false);
      const BodyOf<Dim>& body = scene.body;
      const std::unique_ptr<StepperOf<Dim>> stepper = make_explicit_stepper(scene);
      ImpulsesOf<Dim> impulses = make_impulses(scene);
      StateOf<Dim> state = tumbling<Dim>(body, 2);
      const Eigen::VectorXd held = Eigen::VectorXd::Constant(body.edge_count(), activation);
      const double at_first = energy(scene, state, held);
      for (int k = 0; k < few_steps(120); ++k) ASSERT_EQ(stepper->step(kDt, held, nullptr, state, impulses), Termination::kDone);
      EXPECT_LT(energy(scene, state, held), 1.1 * at_first);  // symplectic steps let it swing about its mean
    }
  }
}

template <int Dim>
Material damped_by(double damping_time) {
  Material material;
  material.damping_time = damping_time;
  return material;
}

TYPED_TEST(Explicit, TakesMostOfTheLinearStabilityBound) {
  constexpr int Dim = TypeParam::kDim;
  for (const double damping_time : {0.0, 0.001, 0.002}) {
    SCOPED_TRACE("damping " + std::to_string(damping_time) + " s");
    const SceneOf<Dim> scene = in_the_air(bar<Dim>(2, 2, 2, 0.1, damped_by<Dim>(damping_time)), false);
    const BodyOf<Dim>& body = scene.body;
    SystemMatrixOf<Dim> matrix(body);
    const double h = make_explicit_stepper(scene)->substep(1);
    // 4 M - 2 h D - h^2 K at the longest stable h has a zero eigenvalue; at the stepper's it is still positive.
    const auto is_stable = [&](double substep) {
      matrix.set_zero();
      matrix.add_mass(body, 4);
      matrix.add_damping(body, body.rest, -2 * substep);
      matrix.add_stiffness(body, body.rest, Eigen::VectorXd::Ones(body.edge_count()), -substep * substep);
      return matrix.factor();
    };
    EXPECT_TRUE(is_stable(1.2 * h));
    EXPECT_FALSE(is_stable(1.27 * h));
  }
}

TYPED_TEST(Explicit, KeepsTheSubstepOfTheElasticForcesWhereDashpotsWouldWantAMuchShorterOne) {
  constexpr int Dim = TypeParam::kDim;
  const auto substep_of = [](double damping_time) {
    return make_explicit_stepper(in_the_air(bar<Dim>(4, 2, 2, 0.1, damped_by<Dim>(damping_time)), false))->substep(1);
  };
  const double undamped = substep_of(0);
  for (const double damping_time : {0.03, 0.1}) {
    SCOPED_TRACE("damping " + std::to_string(damping_time) + " s");
    const double h = substep_of(damping_time);
    EXPECT_LE(h, 1.001 * undamped);
    EXPECT_GT(h, 0.6 * undamped);
  }
}

/// All of the body moves sideways, feet too, which the ground stops or brakes. In short steps its dashpots go without stages.
TYPED_TEST(Explicit, HoldsWhatDashpotsTieToAFootAsMuchShorterSubstepsDo) {
  constexpr int Dim = TypeParam::kDim;
  for (const double friction : {0.2, 0.8, 2.0}) {
    SCOPED_TRACE("friction " + std::to_string(friction));
    const BodyOf<Dim> body = four_legged<Dim>(damped_by<Dim>(0.05));
    SceneOf<Dim> scene = scene_of(body, soles(body), slope<Dim>(0, friction));
    const auto path = [&](int steps, bool in_stages) {
      const std::unique_ptr<StepperOf<Dim>> stepper = make_explicit_stepper(scene);
      ImpulsesOf<Dim> impulses = make_impulses(scene);
      StateOf<Dim> state = laid_down(scene);
      state.v.row(0).setConstant(1);
      for (int k = 0; k < steps; ++k) {
        EXPECT_EQ(stepper->step(0.1 / steps, passive(body), nullptr, state, impulses), Termination::kDone);
      }
      EXPECT_EQ(stepper->work().stages > 0, in_stages);
      return state.x;
    };
    const PointsOf<Dim> truth = path(6000, false), start = laid_down(scene).x;
    EXPECT_LT((path(6, true) - truth).norm(), (friction < 1 ? 0.01 : 0.05) * (truth - start).norm());
  }
}

}  // namespace
}  // namespace hydrostat::physics::explicit_test

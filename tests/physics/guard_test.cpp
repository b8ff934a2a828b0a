#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "physics/internal_forces.h"
#include "tests/physics/element_method_scene.h"

namespace hydrostat::physics::guard_test {
namespace {

constexpr double kDt = 1.0 / 240;

template <typename Case>
class Guard : public testing::Test {};
using GuardedInThePlane = testing::Types<Case<2, Method::kExplicit>, Case<2, Method::kImplicit>>;
using GuardedCases = std::conditional_t<kSanitized, GuardedInThePlane,
                                        testing::Types<Case<2, Method::kExplicit>, Case<3, Method::kExplicit>,
                                                       Case<2, Method::kImplicit>, Case<3, Method::kImplicit>>>;
TYPED_TEST_SUITE(Guard, GuardedCases, CaseName);

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_bare(Method method, const SceneOf<Dim>& scene) {
  return method == Method::kExplicit ? make_explicit_stepper(scene) : make_implicit_stepper(scene);
}

METHOD_TEST(Guard, LeavesSoundStepsAsTheyAreToTheBit) {
  const SceneOf<Dim> scene = scene_of(four_legged<Dim>(), soles(four_legged<Dim>()), slope<Dim>(10, 0.4));
  const auto run = [&](StepperOf<Dim>& stepper) {
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state = laid_down(scene, 0.05);
    std::mt19937 random(1);
    Eigen::VectorXd activation = passive(scene.body);
    for (int k = 0; k < 120; ++k) {
      if (k % 12 == 0) activation = random_activation(random, scene.body, 0.1);
      EXPECT_EQ(stepper.step(kDt, activation, nullptr, state, impulses), Termination::kDone);
    }
    return state;
  };
  const std::unique_ptr<StepperOf<Dim>> guarded = make_stepper(method, scene);
  const StateOf<Dim> with = run(*guarded), without = run(*make_bare(method, scene));
  EXPECT_EQ(with.x, without.x);
  EXPECT_EQ(with.v, without.v);
  EXPECT_EQ(guarded->guard_steps(), 0);
}

METHOD_TEST(Guard, FindsBackFromRandomCollapsedAndFlattenedStarts) {
  const Cut cut = Dim == 2 ? Cut::kTwoTriangles : Cut::kSixTets;
  SceneOf<Dim> scene = cantilever<Dim>(Dim == 2 ? 8 : 4, Dim == 2 ? 2 : 1, cut, {1000, 5e5, 0.4});
  scene.body.held.clear();
  scene.gravity.setZero();
  const int nodes = scene.body.node_count();
  for (unsigned seed = 0; seed < 2; ++seed) {
    std::mt19937 random(seed);
    PointsOf<Dim> flat = scene.body.rest;
    flat.row(1).setZero();
    const PointsOf<Dim> starts[] = {random_points<Dim>(random, nodes, 0.5), random_points<Dim>(random, nodes, 0.0005), flat};
    for (int kind = 0; kind < 3; ++kind) {
      SCOPED_TRACE("start " + std::to_string(kind) + ", seed " + std::to_string(seed));
      const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
      ImpulsesOf<Dim> impulses = make_impulses(scene);
      StateOf<Dim> state{starts[kind], PointsOf<Dim>::Zero(Dim, nodes)};
      for (int k = 0; k < 240; ++k) {
        ASSERT_EQ(stepper->step(kDt, passive(scene.body), nullptr, state, impulses), Termination::kDone) << "step " << k;
      }
      EXPECT_GT(stepper->guard_steps(), 0);
      EXPECT_GT(jacobians(scene.body, state.x).minCoeff(), 0);
      EXPECT_LT(momentum(scene.body, state.v).norm(), 1e-9 * scene.body.mass.sum());
    }
  }
}

/// Does to every step what its maker asks.
template <int Dim>
class Spoilt final : public StepperOf<Dim> {
 public:
  Spoilt(const SceneOf<Dim>& scene, std::function<Termination(StateOf<Dim>&)> spoil)
      : stepper_(make_explicit_stepper(scene)), spoil_(std::move(spoil)) {}
  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    stepper_->step(dt, activation, effect_force, state, impulses);
    return spoil_(state);
  }
  double substep(double dt) const override { return stepper_->substep(dt); }

 private:
  std::unique_ptr<StepperOf<Dim>> stepper_;
  std::function<Termination(StateOf<Dim>&)> spoil_;
};

METHOD_TEST(Guard, TakesStepsAgainThatGainEnergyOrInvertOrAreNoNumber) {
  const BodyOf<Dim> body = four_legged<Dim>();
  const SceneOf<Dim> scene = scene_of(body, soles(body));
  const std::function<Termination(StateOf<Dim>&)> spoils[] = {
      [](StateOf<Dim>& state) { return state.v.array() += 30, Termination::kDone; },
      [&](StateOf<Dim>& state) {
        const VectorOf<Dim> across = state.x.col(body.tets(1, 0)) - state.x.col(body.tets(0, 0));
        state.x.col(body.tets(0, 0)) += 2 * across;
        return Termination::kDone;
      },
      [](StateOf<Dim>& state) { return state.v(0, 0) = std::nan(""), Termination::kDone; },
      [](StateOf<Dim>&) { return Termination::kDiverged; }};
  for (const auto& spoil : spoils) {
    int steps = 0;
    const auto in_the_fifth = [&](StateOf<Dim>& state) { return ++steps == 5 ? spoil(state) : Termination::kDone; };
    const std::unique_ptr<StepperOf<Dim>> stepper =
        make_guarded_stepper<Dim>(scene, std::make_unique<Spoilt<Dim>>(scene, in_the_fifth), {.growth = 8});
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state = laid_down(scene, 0.001);
    state.v.row(1).setConstant(-1);
    for (int k = 0; k < 12; ++k) {
      const StateOf<Dim> before = state;
      ASSERT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);
      EXPECT_LT(momentum_residual(scene, before, state, impulses, kDt), 1e-6) << k;
      EXPECT_EQ(stepper->guard_steps(), k < 4 ? 0 : 1);
    }
    EXPECT_GT(jacobians(body, state.x).minCoeff(), 0);
  }
}

/// A turning bar in flight, stretched by a tenth, whose elastic and kinetic energy are about the same.
SceneOf<2> flying_bar() {
  return in_the_air(make_body(element_bar<2>({8, 2}, {1, 0.25}, Cut::kTwoTriangles, {1000, 5e5, 0.4}), ElementBodyOptions{}),
                    false);
}

TEST(Guard, KeepsTheAngularMomentumOfFreeFlightAndGainsNoEnergyByIt) {
  const SceneOf<2> scene = flying_bar();
  const BodyOf<2>& body = scene.body;
  for (unsigned seed = 0; seed < trials(5u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto never = [](StateOf<2>&) { return Termination::kDiverged; };
    const std::unique_ptr<StepperOf<2>> stepper =
        make_guarded_stepper<2>(scene, std::make_unique<Spoilt<2>>(scene, never), {.growth = 8});
    ImpulsesOf<2> impulses = make_impulses(scene);
    StateOf<2> state{body.rest, rigid_velocity<2>(body, body.rest, {1, 2}, SpinOf<2>(6))};
    state.x.row(0) *= 1.1;
    state.v += random_points<2>(random, body.node_count(), 0.2);
    InternalForces<2> forces(body);
    ASSERT_TRUE(forces.set_activation(passive(body)));
    for (int k = 0; k < 24; ++k) {
      const StateOf<2> before = state;
      ASSERT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);
      const SpinOf<2> spin = angular_momentum(body, before.x, before.v, VectorOf<2>::Zero());
      EXPECT_LT((angular_momentum(body, state.x, state.v, VectorOf<2>::Zero()) - spin).norm(), 1e-9 * spin.norm()) << k;
      EXPECT_LT(momentum_residual(scene, before, state, impulses, kDt), 1e-6) << k;
      // What turned it is booked, and is a turn alone.
      const PointsOf<2>& turn = impulses.correction_nodes;
      EXPECT_GT(turn.norm(), 0) << k;
      EXPECT_LT(turn.rowwise().sum().norm(), 1e-9 * turn.norm()) << k;
      const double energy_before = kinetic_energy(body, before.v) + forces.elastic_energy(before.x);
      EXPECT_LT(kinetic_energy(body, state.v) + forces.elastic_energy(state.x), (1 + 1e-12) * energy_before) << k;
    }
    EXPECT_EQ(stepper->guard_steps(), 24);
  }
}

TEST(Guard, TriesAStepAgainInShorterOnesWhereToldTo) {
  const SceneOf<2> scene = flying_bar();
  const BodyOf<2>& body = scene.body;
  for (const int most_parts : {1, 2, 4}) {
    int calls = 0;
    const auto in_the_third = [&](StateOf<2>&) {
      return ++calls == 3 || calls == 4 ? Termination::kDiverged : Termination::kDone;
    };
    const std::unique_ptr<StepperOf<2>> stepper = make_guarded_stepper<2>(
        scene, std::make_unique<Spoilt<2>>(scene, in_the_third), {.growth = 8, .most_parts = most_parts});
    ImpulsesOf<2> impulses = make_impulses(scene);
    StateOf<2> state{body.rest, rigid_velocity<2>(body, body.rest, {1, 2}, SpinOf<2>(6))};
    const PointsOf<2> push = PointsOf<2>::Constant(2, body.node_count(), 3);
    for (int k = 0; k < 3; ++k) {
      const StateOf<2> before = state;
      ASSERT_EQ(stepper->step(kDt, passive(body), &push, state, impulses), Termination::kDone);
      EXPECT_LT((impulses.effect_nodes - kDt * push).norm(), 1e-12) << most_parts << " parts";
      EXPECT_LT(momentum_residual(scene, before, state, impulses, kDt), 1e-6);
    }
    EXPECT_EQ(stepper->guard_steps(), most_parts == 4 ? 0 : 1);
    EXPECT_EQ(calls, most_parts == 1 ? 3 : most_parts == 2 ? 4 : 8);  // wholes, one half, four quarters
  }
}

TEST(Guard, ShortensTheSubstepsOfABodyStrainedFarBeforeItGivesAStepToEuler) {
  int unstable = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const SceneOf<3> scene = in_the_air(random_body<3>(seed), false);
    const BodyOf<3>& body = scene.body;
    std::mt19937 random(seed);
    StateOf<3> state{1.3 * body.rest, rigid_velocity<3>(body, body.rest, {1, 2, 0}, random_spin<3>(random, 6))};
    state.x += random_points<3>(random, body.node_count(), 0.1 * body.rest_length.mean());
    const Eigen::VectorXd activation = random_activation(random, body, 0.3);
    InternalForces<3> forces(body);
    ASSERT_TRUE(forces.set_activation(activation));
    const auto energy = [&](const StateOf<3>& at) { return kinetic_energy(body, at.v) + forces.elastic_energy(at.x); };
    const auto spin = [&](const StateOf<3>& at) -> SpinOf<3> {
      return angular_momentum(body, at.x, at.v, centre_of_mass(body, at.x));
    };
    const SpinOf<3> at_first = spin(state);
    // Returns the most that a step makes of the energy [-].
    const auto run = [&](StepperOf<3>& stepper, StateOf<3> at) {
      ImpulsesOf<3> impulses = make_impulses(scene);
      double growth = 0;
      for (int k = 0; k < 30; ++k) {
        const double before = energy(at);
        EXPECT_EQ(stepper.step(kDt, activation, nullptr, at, impulses), Termination::kDone);
        growth = std::max(growth, energy(at) / before);
      }
      EXPECT_LT((spin(at) - at_first).norm(), 1e-9 * at_first.norm());
      return growth;
    };
    const std::unique_ptr<StepperOf<3>> guarded = make_stepper(Method::kExplicit, scene);
    EXPECT_LT(run(*guarded, state), 1.05);
    EXPECT_EQ(guarded->guard_steps(), 0);
    if (run(*make_explicit_stepper(scene), state) > 1.05) ++unstable;
  }
  EXPECT_GT(unstable, 0);
}

/// Diverges where its substeps are longer than it is told to bear.
class Touchy final : public StepperOf<2> {
 public:
  explicit Touchy(const SceneOf<2>& scene) : stepper_(make_explicit_stepper(scene)) {}
  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<2>* effect_force, StateOf<2>& state,
                   ImpulsesOf<2>& impulses) override {
    last = times_;
    stepper_->step(dt, activation, effect_force, state, impulses);
    return times_ < wants ? Termination::kDiverged : Termination::kDone;
  }
  bool shorten(int times) override { return times_ = times, stepper_->shorten(times); }
  double substep(double dt) const override { return stepper_->substep(dt); }
  StepWork work() const override { return stepper_->work(); }

  int wants = 1, last = 0;

 private:
  std::unique_ptr<StepperOf<2>> stepper_;
  int times_ = 1;
};

TEST(Guard, KeepsSubstepsShortForHalfASecondAndThenGoesBackByHalves) {
  const SceneOf<2> scene = flying_bar();
  const BodyOf<2>& body = scene.body;
  auto owned = std::make_unique<Touchy>(scene);
  Touchy& touchy = *owned;
  const std::unique_ptr<StepperOf<2>> stepper = make_guarded_stepper<2>(scene, std::move(owned), {.growth = 8, .most_parts = 4});
  ImpulsesOf<2> impulses = make_impulses(scene);
  StateOf<2> state{body.rest, rigid_velocity<2>(body, body.rest, {1, 2}, SpinOf<2>(6))};
  const int half_second = static_cast<int>(std::lround(0.5 / kDt));
  std::vector<int> shorter;
  for (int k = 0; k < 3 * half_second; ++k) {
    touchy.wants = k == 10 ? 4 : 1;
    ASSERT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);
    shorter.push_back(touchy.last);
  }
  EXPECT_EQ(std::count(shorter.begin(), shorter.begin() + 10, 1), 10);
  EXPECT_TRUE(std::is_sorted(shorter.begin() + 10, shorter.end(), std::greater<>()));
  EXPECT_NEAR(static_cast<double>(std::count(shorter.begin(), shorter.end(), 4)), half_second, 2);
  EXPECT_NEAR(static_cast<double>(std::count(shorter.begin(), shorter.end(), 2)), half_second, 2);
  EXPECT_EQ(shorter.back(), 1);
  EXPECT_EQ(stepper->guard_steps(), 0);
  touchy.wants = 8;
  ASSERT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);
  EXPECT_EQ(stepper->guard_steps(), 1);
}

}  // namespace
}  // namespace hydrostat::physics::guard_test

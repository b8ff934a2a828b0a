#include "physics/recovery.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics::recovery_test {
namespace {

constexpr double kDt = 1.0 / 240;

/// Counts its steps and leaves the state as it is.
template <int Dim>
class Idle final : public StepperOf<Dim> {
 public:
  explicit Idle(int& steps) : steps_(steps) {}
  Termination step(double, const Eigen::VectorXd&, const PointsOf<Dim>*, StateOf<Dim>&, ImpulsesOf<Dim>& impulses) override {
    clear(impulses);
    return ++steps_, Termination::kDone;
  }
  double substep(double dt) const override { return dt; }

 private:
  int& steps_;
};

template <typename Dimension>
class Recovery : public testing::Test {};
TYPED_TEST_SUITE(Recovery, SimulatedDimensions, DimensionName);

/// Nodes anywhere in a box of a metre, turning and drifting.
template <int Dim>
StateOf<Dim> scattered(const BodyOf<Dim>& body, unsigned seed) {
  std::mt19937 random(seed);
  const PointsOf<Dim> x = random_points<Dim>(random, body.node_count(), 0.5);
  return {x, rigid_velocity<Dim>(body, x, random_points<Dim>(random, 1, 1), random_spin<Dim>(random, 2))};
}

TYPED_TEST(Recovery, LeadsScatteredBodiesBackToTheirRestShape) {
  constexpr int Dim = TypeParam::kDim;
  const SceneOf<Dim> scene = in_the_air(bar<Dim>(5, 2, 2, 0.1), false);
  const BodyOf<Dim>& body = scene.body;
  for (unsigned seed = 0; seed < trials(10u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    int others = 0;
    RecoveringStepper<Dim> stepper(scene, std::make_unique<Idle<Dim>>(others));
    StateOf<Dim> state = scattered(body, seed);
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    const VectorOf<Dim> drift = momentum<Dim>(body, state.v);
    const SpinOf<Dim> turn = angular_momentum<Dim>(body, state.x, state.v, VectorOf<Dim>::Zero());
    int steps = 0;
    double moved_most = 0;
    const double elastic = elastic_energy<Dim>(body, state.x, passive(body)), own = kinetic_energy<Dim>(body, state.v);
    do {
      ASSERT_EQ(stepper.step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);
      moved_most = std::max(moved_most, kinetic_energy<Dim>(body, state.v));
    } while (++steps < 2400 && stepper.is_recovering());
    EXPECT_EQ(others, 0);
    EXPECT_EQ(stepper.guard_steps(), steps);
    EXPECT_GT(jacobians<Dim>(body, state.x).minCoeff(), 0.5);
    EXPECT_LT((momentum<Dim>(body, state.v) - drift).norm(), 1e-9 * body.mass.sum());
    EXPECT_LT((angular_momentum<Dim>(body, state.x, state.v, VectorOf<Dim>::Zero()) - turn).norm(), 1e-9 * body.mass.sum());
    EXPECT_LT(moved_most, 2 * own + 0.05 * elastic);
    stepper.step(kDt, passive(body), nullptr, state, impulses);
    EXPECT_EQ(others, 1);
  }
}

TYPED_TEST(Recovery, StaysOutOfTheGroundAndBooksItsImpulses) {
  constexpr int Dim = TypeParam::kDim;
  SceneOf<Dim> scene;
  scene.body = bar<Dim>(4, 2, 2, 0.1);
  touch_with_whole_surface(scene);
  const BodyOf<Dim>& body = scene.body;
  int others = 0;
  RecoveringStepper<Dim> stepper(scene, std::make_unique<Idle<Dim>>(others));
  StateOf<Dim> state = scattered(body, 3);
  state.x.row(1).array() += 0.501;
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  for (int k = 0; k < 2400 && others == 0; ++k) {
    const StateOf<Dim> before = state;
    ASSERT_EQ(stepper.step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);
    if (others > 0) break;
    EXPECT_GT(state.x.row(1).minCoeff(), -1e-6);
    const VectorOf<Dim> booked = impulses.contact_nodes.rowwise().sum() + kDt * body.mass.sum() * scene.gravity;
    EXPECT_LT((momentum<Dim>(body, state.v) - momentum<Dim>(body, before.v) - booked).norm(), 1e-9 * body.mass.sum());
    const SpinOf<Dim> turn = angular_momentum<Dim>(body, state.x, state.v, VectorOf<Dim>::Zero()) -
                             angular_momentum<Dim>(body, before.x, before.v, VectorOf<Dim>::Zero());
    EXPECT_LT((turn - impulses.contact_moment - impulses.gravity_moment).norm(), 1e-9 * body.mass.sum());
  }
  EXPECT_EQ(others, 1);
}

TYPED_TEST(Recovery, LeavesSoundStatesAndHeldBodiesToTheMethod) {
  constexpr int Dim = TypeParam::kDim;
  SceneOf<Dim> scene = in_the_air(bar<Dim>(5, 2, 2, 0.1), false);
  int others = 0;
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  StateOf<Dim> sound{1.5 * scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  RecoveringStepper<Dim>(scene, std::make_unique<Idle<Dim>>(others)).step(kDt, passive(scene.body), nullptr, sound, impulses);
  EXPECT_EQ(others, 1);
  StateOf<Dim> broken = scattered(scene.body, 1);
  scene.body.held = {0};
  RecoveringStepper<Dim>(scene, std::make_unique<Idle<Dim>>(others)).step(kDt, passive(scene.body), nullptr, broken, impulses);
  EXPECT_EQ(others, 2);
}

}  // namespace
}  // namespace hydrostat::physics::recovery_test

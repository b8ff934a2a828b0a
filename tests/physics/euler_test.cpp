#include <gtest/gtest.h>

#include <cmath>

#include "physics/internal_forces.h"
#include "tests/physics/element_method_scene.h"

namespace hydrostat::physics::euler_test {
namespace {

constexpr double kDt = 1.0 / 240;

template <typename Dimension>
class Euler : public testing::Test {};
TYPED_TEST_SUITE(Euler, SimulatedDimensions, DimensionName);

TYPED_TEST(Euler, LosesAngularMomentumInFreeFlightAndHidesNoneOfIt) {
  constexpr int Dim = TypeParam::kDim;
  const BodyOf<Dim> shape = bar<Dim>(6, 2, 2, 0.1);
  const SceneOf<Dim> scene = in_the_air(shape, false);
  const BodyOf<Dim>& body = scene.body;
  const std::unique_ptr<StepperOf<Dim>> stepper = make_euler_stepper(scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  const VectorOf<Dim> centre = centre_of_mass(body, body.rest);
  SpinOf<Dim> rate;
  if constexpr (Dim == 3) {
    rate << 1, 4, 2;
  } else {
    rate << 4.6;
  }
  StateOf<Dim> state{body.rest, rigid_velocity<Dim>(body, body.rest, VectorOf<Dim>::Zero(), rate)};
  const double at_first = angular_momentum(body, state.x, state.v, centre).norm();
  for (int k = 0; k < few_steps(240); ++k) {
    ASSERT_EQ(stepper->step(kDt, Eigen::VectorXd::Ones(body.edge_count()), nullptr, state, impulses), Termination::kDone);
    EXPECT_EQ(impulses.contact_moment.norm() + impulses.effect_moment.norm() + impulses.gravity_moment.norm(), 0);
  }
  if (kSanitized) return;  // the rest is of the end
  const double lost = 1 - angular_momentum(body, state.x, state.v, centre_of_mass(body, state.x)).norm() / at_first;
  EXPECT_GT(lost, 0.1);
  EXPECT_LT(lost, 0.4);  // a quarter in a second at 4.6 rad/s
}

TYPED_TEST(Euler, MovesWithTheVelocitiesThatItBooks) {
  constexpr int Dim = TypeParam::kDim;
  const BodyOf<Dim> shape = bar<Dim>(5, 3, 2, 0.1);
  const SceneOf<Dim> scene = scene_of(shape, soles(shape), slope<Dim>(10, 0.5));
  const std::unique_ptr<StepperOf<Dim>> stepper = make_euler_stepper(scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  StateOf<Dim> state = laid_down(scene, 0.01);
  std::mt19937 random(1);
  const double size = size_of(shape);
  for (int k = 0; k < few_steps(240); ++k) {
    const StateOf<Dim> before = state;
    const Eigen::VectorXd activation = random_activation(random, shape, 0.05);
    ASSERT_EQ(stepper->step(kDt, activation, nullptr, state, impulses), Termination::kDone) << "step " << k;
    EXPECT_LT(((state.x - before.x) / kDt - state.v).colwise().norm().maxCoeff(), 1.01e-4 * size);  // [m/s]
  }
}

TYPED_TEST(Euler, GoesOnFromWhereItFindsNoMinimumAndGainsNothingByIt) {
  constexpr int Dim = TypeParam::kDim;
  // Soft elements whose neighbours pull them inside out and outside in at every step: Newton's method does not get to the end.
  std::mt19937 random(5);
  const BodyOf<Dim> shape = random_element_body<Dim>(2, Cut::kBoxes, ElasticLaw::kStableNeoHookean);
  const SceneOf<Dim> scene = in_the_air(shape, false);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_euler_stepper(scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  InternalForces<Dim> forces(scene.body);
  ASSERT_TRUE(forces.set_activation(passive(shape)));
  for (unsigned trial = 0; trial < trials(10u); ++trial) {
    const StateOf<Dim> start{random_points<Dim>(random, shape.node_count(), 0.1), random_points<Dim>(random, shape.node_count(), 1)};
    StateOf<Dim> state = start;
    ASSERT_EQ(stepper->step(1.0 / 15, passive(shape), nullptr, state, impulses), Termination::kDone) << trial;
    EXPECT_LT((momentum<Dim>(shape, state.v) - momentum<Dim>(shape, start.v)).norm(), 1e-9 * shape.mass.sum());
    EXPECT_LE(kinetic_energy<Dim>(shape, state.v) + forces.elastic_energy(state.x),
              1.0001 * (kinetic_energy<Dim>(shape, start.v) + forces.elastic_energy(start.x)));
    stepper->forget();
  }
}

TEST(Euler, SolvesStepsOfNodesWhoseEnergyIsLessThanTheRoundingOfTheElements) {
  ElementMesh<2> mesh = element_bar<2>({6, 3}, {0.6, 0.3}, Cut::kTwoTriangles);
  for (Eigen::Index e = 0; e < mesh.nodes.cols(); ++e) {
    const bool is_light = mesh.rest(0, mesh.nodes(0, e)) + mesh.rest(0, mesh.nodes(1, e)) + mesh.rest(0, mesh.nodes(2, e)) > 0.9;
    if (e == 0) mesh.materials.clear();
    mesh.materials.push_back({is_light ? 1.0 : 1000.0, 1e9, 0.4});
  }
  const SceneOf<2> scene = in_the_air(make_body(mesh, ElementBodyOptions{}), false);
  const BodyOf<2>& body = scene.body;
  ImpulsesOf<2> impulses = make_impulses(scene);
  for (unsigned seed = 0; seed < trials(10u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    StateOf<2> state{body.rest, random_points<2>(random, body.node_count(), 0.05 * size_of(body))};
    for (int i = 0; i < body.node_count(); ++i) {
      if (body.mass[i] > 0.1 * body.mass.maxCoeff()) state.v.col(i).setZero();
    }
    const std::unique_ptr<StepperOf<2>> stepper = make_euler_stepper(scene);
    for (int k = 0; k < 3; ++k) {
      const StateOf<2> before = state;
      ASSERT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone) << "step " << k;
      EXPECT_LT(((state.x - before.x) / kDt - state.v).colwise().norm().maxCoeff(), 1.01e-4 * size_of(body)) << "step " << k;
    }
    EXPECT_EQ(stepper->guard_steps(), 0);
  }
}

TYPED_TEST(Euler, ConvergesToTheExplicitMotionAsTheStepShrinks) {
  constexpr int Dim = TypeParam::kDim;
  const SceneOf<Dim> scene = in_the_air(bar<Dim>(3, 2, 2, 0.1), true);
  const BodyOf<Dim>& body = scene.body;
  std::mt19937 random(1);
  const Eigen::VectorXd activation = random_activation(random, body, 0.1);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  const auto after_a_tenth_second = [&](StepperOf<Dim>& stepper, double dt) {
    StateOf<Dim> state{body.rest, PointsOf<Dim>::Zero(Dim, body.node_count())};
    const int steps = few_steps(static_cast<int>(std::round(0.1 / dt)));
    for (int k = 0; k < steps; ++k) stepper.step(dt, activation, nullptr, state, impulses);
    return state.x;
  };
  const PointsOf<Dim> reference = after_a_tenth_second(*make_explicit_stepper(scene), 1.0 / 200000);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_euler_stepper(scene);
  double last = (after_a_tenth_second(*stepper, 1.0 / 480) - reference).norm();
  for (const double rate : {960.0, 1920.0, 3840.0}) {
    const double error = (after_a_tenth_second(*stepper, 1 / rate) - reference).norm();
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_GT(std::log2(last / error), 0.8) << rate << " steps a second";
    last = error;
  }
}

TYPED_TEST(Euler, SinksIntoTheGroundByNoMoreThanItsShareOfTheSize) {
  constexpr int Dim = TypeParam::kDim;
  for (const double cell : {0.005, 0.1, 2.0}) {
    SCOPED_TRACE("cell " + std::to_string(cell) + " m");
    Material material;
    material.youngs_modulus = 2e7 * cell;  // as soft under its own weight at any scale
    const BodyOf<Dim> shape = bar<Dim>(4, 2, 2, cell, material);
    const SceneOf<Dim> scene = scene_of(shape, soles(shape));
    const std::unique_ptr<StepperOf<Dim>> stepper = make_euler_stepper(scene);
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state = laid_down(scene);
    for (int k = 0; k < few_steps(480); ++k) {
      ASSERT_EQ(stepper->step(kDt, Eigen::VectorXd::Ones(shape.edge_count()), nullptr, state, impulses), Termination::kDone);
    }
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_LT(-state.x.row(1).minCoeff(), 0.0005 * size_of(shape));
    EXPECT_GT(-state.x.row(1).minCoeff(), 0);
  }
}

}  // namespace
}  // namespace hydrostat::physics::euler_test

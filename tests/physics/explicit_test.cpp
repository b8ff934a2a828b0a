#include <gtest/gtest.h>

#include <cmath>

#include "physics/system_matrix.h"
#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics {
namespace {

constexpr double kDt = 1.0 / 240;

Scene in_the_air(Body body, bool with_gravity) {
  Scene scene = scene_of(std::move(body), {});
  scene.has_ground = false;
  if (!with_gravity) scene.gravity.setZero();
  return scene;
}

State tumbling(const Body& body, unsigned seed) {
  std::mt19937 random(seed);
  const Eigen::Vector3d rate = random_points(random, 1, 6), centre = centre_of_mass(body, body.rest);
  State state{body.rest, Eigen::Matrix3Xd(3, body.node_count())};
  for (int i = 0; i < body.node_count(); ++i)
    state.v.col(i) = Eigen::Vector3d(1, 2, 0) + rate.cross(body.rest.col(i) - centre);
  return state;
}

TEST(Explicit, KeepsAngularMomentumInFreeFlightWhateverTheActivation) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Scene scene = in_the_air(random_body(seed), seed % 2 == 0);
    const Body& body = scene.body;
    const std::unique_ptr<Stepper> stepper = make_explicit_stepper(scene);
    Impulses impulses = make_impulses(scene);
    State state = tumbling(body, seed);
    const auto spin = [&] { return angular_momentum(body, state.x, state.v, centre_of_mass(body, state.x)); };
    const Eigen::Vector3d at_first = spin();
    for (int k = 0; k < 240; ++k) {
      const Eigen::VectorXd activation = random_activation(random, body, 0.2);
      ASSERT_EQ(stepper->step(kDt, activation, nullptr, state, impulses), Termination::kDone);
    }
    EXPECT_LT((spin() - at_first).norm(), 1e-9 * at_first.norm());
  }
}

TEST(Explicit, ConvergesWithTheStepInFreeFlight) {
  const Scene scene = in_the_air(bar(3, 2, 2, 0.1), true);
  const std::unique_ptr<Stepper> stepper = make_explicit_stepper(scene);
  Impulses impulses = make_impulses(scene);
  std::mt19937 random(1);
  const Eigen::VectorXd activation = random_activation(random, scene.body, 0.1);
  const double coarse = stepper->substep(kDt);
  const auto after_a_tenth_second = [&](int halvings) {
    State state = tumbling(scene.body, 1);
    const double h = coarse / std::exp2(halvings);
    const auto steps = static_cast<int>(std::round(0.1 / coarse)) << halvings;
    for (int k = 0; k < steps; ++k) stepper->step(h, activation, nullptr, state, impulses);
    return state.x;
  };
  const Eigen::Matrix3Xd reference = after_a_tenth_second(6);
  double last = (after_a_tenth_second(0) - reference).norm();
  for (int halvings = 1; halvings < 4; ++halvings) {
    const double error = (after_a_tenth_second(halvings) - reference).norm();
    EXPECT_GT(std::log2(last / error), 0.9) << halvings << " halvings";
    last = error;
  }
}

TEST(Explicit, StaysStableUnderSuddenActivationOfFortyPercentAndOfTwentyWithoutDamping) {
  for (const double damping_time : {0.0, 0.002, 0.01}) {
    for (const double activation : {0.6, 0.8, 1.0, 1.2, 1.4}) {
      if (damping_time == 0 && std::abs(activation - 1) > 0.3) continue;
      SCOPED_TRACE("damping " + std::to_string(damping_time) + " s, activation " + std::to_string(activation));
      Material material;
      material.damping_time = damping_time;
      const Scene scene = in_the_air(bar(4, 2, 2, 0.1, material), false);
      const Body& body = scene.body;
      const std::unique_ptr<Stepper> stepper = make_explicit_stepper(scene);
      Impulses impulses = make_impulses(scene);
      State state = tumbling(body, 2);
      const Eigen::VectorXd held = Eigen::VectorXd::Constant(body.edge_count(), activation);
      const double at_first = energy(scene, state, held);
      for (int k = 0; k < 120; ++k) ASSERT_EQ(stepper->step(kDt, held, nullptr, state, impulses), Termination::kDone);
      EXPECT_LT(energy(scene, state, held), 1.1 * at_first);  // symplectic steps let it swing about its mean
    }
  }
}

TEST(Explicit, TakesMostOfTheLinearStabilityBound) {
  for (const double damping_time : {0.0, 0.002, 0.01}) {
    SCOPED_TRACE("damping " + std::to_string(damping_time) + " s");
    Material material;
    material.damping_time = damping_time;
    const Scene scene = in_the_air(bar(2, 2, 2, 0.1, material), false);
    const Body& body = scene.body;
    SystemMatrix matrix(body);
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

}  // namespace
}  // namespace hydrostat::physics

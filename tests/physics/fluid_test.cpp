#include "physics/fluid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "physics/simplex_mesh.h"
#include "physics/stepper.h"
#include "tests/sanitizers.h"

namespace hydrostat::physics::fluid_test {
namespace {

/// A box of springs that nothing but a fluid and gravity acts on, in a shape drawn from a seed.
template <int Dim>
SceneOf<Dim> swimmer(unsigned seed) {
  std::mt19937 random(seed);
  const auto within = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967295.0);
  };
  const SimplexMeshOf<Dim> mesh = mesh_of_box<Dim>(VectorOf<Dim>::Constant(0.3), Eigen::Matrix<int, Dim, 1>::Constant(2));
  SceneOf<Dim> scene;
  scene.body = make_body<Dim>(mesh.nodes, mesh.simplices, edges_of(mesh), Eigen::VectorXd::Ones(mesh.simplices.cols()), {});
  for (int i = 0; i < scene.body.node_count(); ++i) {
    for (int d = 0; d < Dim; ++d) scene.body.rest(d, i) += within(-0.02, 0.02);
  }
  scene.has_ground = false;
  return scene;
}

template <typename Dimension>
class Fluids : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Fluids, Dimensions);

/// Archimedes' law: the weight of the water in its place, in the middle of its volume.
TYPED_TEST(Fluids, BearTheWeightOfWhatTheBodyFills) {
  constexpr int Dim = TypeParam::value;
  for (unsigned seed = 0; seed < trials(10u); ++seed) {
    const SceneOf<Dim> scene = swimmer<Dim>(seed);
    for (const double level : {std::numeric_limits<double>::infinity(), 0.7}) {
      FluidOf<Dim> water;
      water.level = level;
      FluidEffect<Dim> effect(scene, water);
      const StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
      PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, scene.body.node_count());
      effect.add_forces(0.01, state, force);
      double volume_now = 0;
      VectorOf<Dim> middle = VectorOf<Dim>::Zero();
      const Eigen::VectorXd share = jacobians<Dim>(scene.body, state.x);
      for (int t = 0; t < scene.body.tet_count(); ++t) {
        const double part = share[t] * scene.body.rest_volume[t];
        VectorOf<Dim> centre = VectorOf<Dim>::Zero();
        for (int k = 0; k <= Dim; ++k) centre += state.x.col(scene.body.tets(k, t)) / (Dim + 1);
        volume_now += part;
        middle += part * centre;
      }
      middle /= volume_now;
      const VectorOf<Dim> lift = force.rowwise().sum();
      EXPECT_LT((lift + water.density * volume_now * scene.gravity).norm(), 1e-10 * lift.norm());
      SpinOf<Dim> moment = SpinOf<Dim>::Zero();
      for (int i = 0; i < scene.body.node_count(); ++i) moment += cross<Dim>(state.x.col(i) - middle, force.col(i));
      EXPECT_LT(moment.norm(), 1e-10 * lift.norm());
    }
  }
}

/// What moves in it is slowed and never turned around, however long the step.
TYPED_TEST(Fluids, ResistMotionAndTurnNoneAround) {
  constexpr int Dim = TypeParam::value;
  SceneOf<Dim> scene = swimmer<Dim>(1);
  scene.gravity.setZero();
  FluidEffect<Dim> effect(scene, {});
  for (const double speed : {0.1, 10.0, 1000.0}) {
    for (const double dt : {1e-4, 0.1, 10.0}) {
      StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
      state.v.row(0).setConstant(speed);
      PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, scene.body.node_count());
      effect.add_forces(dt, state, force);
      EXPECT_LT(force.row(0).sum(), 0);
      EXPECT_LE(force.cwiseProduct(state.v).maxCoeff(), 0);
      for (int i = 0; i < scene.body.node_count(); ++i)
        EXPECT_LT(dt * force.col(i).norm() / scene.body.mass[i], speed * (1 + 1e-12));
    }
  }
}

TYPED_TEST(Fluids, DoNothingAboveTheirLevelOrAtTheirOwnSpeed) {
  constexpr int Dim = TypeParam::value;
  const SceneOf<Dim> scene = swimmer<Dim>(2);
  StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  state.v.row(0).setConstant(0.7);
  PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, scene.body.node_count());
  FluidOf<Dim> far_below;
  far_below.level = -5;
  FluidEffect<Dim>(scene, far_below).add_forces(0.01, state, force);
  EXPECT_TRUE(force.isZero(0));
  FluidOf<Dim> stream;
  stream.velocity = 0.7 * VectorOf<Dim>::UnitX();
  SceneOf<Dim> weightless = scene;
  weightless.gravity.setZero();
  FluidEffect<Dim>(weightless, stream).add_forces(0.01, state, force);
  EXPECT_TRUE(force.isZero(0));
}

TEST(PlanEffects, HoldsWhatTheSceneHas) {
  SceneOf<2> scene = swimmer<2>(3);
  EXPECT_TRUE(plan_effects(scene).empty());
  scene.water.emplace();
  EXPECT_EQ(plan_effects(scene).size(), 1U);
  scene.air.emplace();
  EXPECT_EQ(plan_effects(scene).size(), 2U);
}

}  // namespace
}  // namespace hydrostat::physics::fluid_test

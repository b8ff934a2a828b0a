#include "physics/fluid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <utility>

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

/// What the body displaces [m3], and its middle.
template <int Dim>
std::pair<double, VectorOf<Dim>> displaced(const BodyOf<Dim>& body, const PointsOf<Dim>& x) {
  double volume = 0;
  VectorOf<Dim> middle = VectorOf<Dim>::Zero();
  const Eigen::VectorXd stretch = jacobians<Dim>(body, x);
  for (int t = 0; t < body.tet_count(); ++t) {
    const double part = (body.displaced_share.size() > 0 ? body.displaced_share[t] : 1) * stretch[t] * body.rest_volume[t];
    VectorOf<Dim> centre = VectorOf<Dim>::Zero();
    for (int k = 0; k <= Dim; ++k) centre += x.col(body.tets(k, t)) / (Dim + 1);
    volume += part;
    middle += part * centre;
  }
  return {volume, middle / volume};
}

/// Of each tet a share drawn from the seed.
template <int Dim>
void thin_out(unsigned seed, BodyOf<Dim>& body) {
  std::mt19937 random(seed);
  body.displaced_share.resize(body.tet_count());
  for (double& share : body.displaced_share) share = 0.05 + 0.95 * static_cast<double>(random()) / 4294967295.0;
}

template <int Dim>
PointsOf<Dim> force_at_rest(const SceneOf<Dim>& scene, const FluidOf<Dim>& fluid, const PointsOf<Dim>& x) {
  PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, x.cols());
  FluidEffect<Dim>(scene, fluid).add_forces(0.01, {x, PointsOf<Dim>::Zero(Dim, x.cols())}, force);
  return force;
}

/// Archimedes' law: the weight of the water in its place, in the middle of what it displaces.
TYPED_TEST(Fluids, BearTheWeightOfWhatTheBodyFills) {
  constexpr int Dim = TypeParam::value;
  for (unsigned seed = 0; seed < trials(10u); ++seed) {
    for (const bool is_full : {true, false}) {
      SceneOf<Dim> scene = swimmer<Dim>(seed);
      if (!is_full) thin_out(seed, scene.body);
      for (const double level : {std::numeric_limits<double>::infinity(), 0.7}) {
        FluidOf<Dim> water;
        water.level = level;
        const PointsOf<Dim>& x = scene.body.rest;
        const PointsOf<Dim> force = force_at_rest(scene, water, x);
        const auto [volume, middle] = displaced<Dim>(scene.body, x);
        const VectorOf<Dim> lift = force.rowwise().sum();
        EXPECT_LT((lift + water.density * volume * scene.gravity).norm(), 1e-10 * lift.norm());
        SpinOf<Dim> moment = SpinOf<Dim>::Zero();
        for (int i = 0; i < scene.body.node_count(); ++i) moment += cross<Dim>(x.col(i) - middle, force.col(i));
        EXPECT_LT(moment.norm(), 1e-10 * lift.norm());
      }
    }
  }
}

/// Where a fluid is everywhere no height is told from another: neither on a body nor on a part that has drifted off.
TYPED_TEST(Fluids, EverywhereActAlikeAtEveryHeight) {
  constexpr int Dim = TypeParam::value;
  for (unsigned seed = 0; seed < trials(10u); ++seed) {
    SceneOf<Dim> scene = swimmer<Dim>(seed);
    if (seed % 2 == 1) thin_out(seed, scene.body);
    if (seed % 3 == 1) scene.gravity.setConstant(-3);
    for (const double density : {1000.0, 1.2}) {
      FluidOf<Dim> fluid;
      fluid.density = density;
      const PointsOf<Dim> force = force_at_rest(scene, fluid, scene.body.rest);
      for (const double height : {-50.0, -10.0, 0.5, 10.0, 50.0, 1000.0}) {
        const PointsOf<Dim> x = scene.body.rest.colwise() + VectorOf<Dim>(height * VectorOf<Dim>::UnitY());
        EXPECT_LT((force_at_rest(scene, fluid, x) - force).norm(), 1e-9 * force.norm()) << "at " << height;
      }
    }
  }
}

TYPED_TEST(Fluids, EverywhereActOnEachPartAsIfItWereAlone) {
  constexpr int Dim = TypeParam::value;
  const SceneOf<Dim> one = swimmer<Dim>(4);
  const int nodes = one.body.node_count();
  SceneOf<Dim> two = one;
  two.body.rest.conservativeResize(Eigen::NoChange, 2 * nodes);
  two.body.rest.rightCols(nodes) = one.body.rest;
  two.body.mass = one.body.mass.replicate(2, 1).eval();
  two.body.tets.conservativeResize(Eigen::NoChange, 2 * one.body.tet_count());
  two.body.tets.rightCols(one.body.tet_count()) = one.body.tets.array() + nodes;
  two.body.rest_volume = one.body.rest_volume.replicate(2, 1).eval();
  const PointsOf<Dim> alone = force_at_rest(one, {}, one.body.rest);
  for (const double apart : {0.0, 3.0, -40.0}) {
    PointsOf<Dim> x = two.body.rest;
    x.row(1).tail(nodes).array() += apart;
    const PointsOf<Dim> force = force_at_rest(two, {}, x);
    EXPECT_LT((force.leftCols(nodes) - alone).norm(), 1e-10 * alone.norm());
    EXPECT_LT((force.rightCols(nodes) - alone).norm(), 1e-10 * alone.norm());
  }
}

/// Resistance goes with the area that is wetted, whatever the tets displace.
TYPED_TEST(Fluids, ResistByTheAreaThatIsWetted) {
  constexpr int Dim = TypeParam::value;
  SceneOf<Dim> scene = swimmer<Dim>(5);
  scene.gravity.setZero();
  StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Constant(Dim, scene.body.node_count(), 1e-3)};
  const auto resistance = [&] {
    PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, scene.body.node_count());
    FluidEffect<Dim>(scene, {}).add_forces(1e-9, state, force);
    return force;
  };
  const PointsOf<Dim> whole = resistance();
  thin_out(5, scene.body);
  EXPECT_EQ(resistance(), whole);
  scene.body.wetted_share = 0.4;
  EXPECT_LT((resistance() - 0.4 * whole).norm(), 1e-9 * whole.norm());
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

#include "physics/way_out.h"

#include <gtest/gtest.h>

#include "tests/physics/deepest_place.h"
#include "tests/physics/obstacle_shapes.h"

namespace hydrostat::physics::way_out_test {
namespace {

template <typename Dimension>
class WaysOut : public testing::Test {};
TYPED_TEST_SUITE(WaysOut, SimulatedDimensions, DimensionName);

/// A bar of 0.4 x 0.2 (x 0.2) m in the middle of an obstacle 0.9 m high that stands on the ground.
template <int Dim>
SceneOf<Dim> swallowed(const std::variant<HalfSpace, BoxOf<Dim>, Ball, ClosedMeshOf<Dim>>& shape) {
  SceneOf<Dim> scene = scene_of(bar<Dim>(4, 2, 2, 0.1, {1000, 5e4}), {});
  scene.body.rest.colwise() += vec<Dim>(-0.2, 0.35, -0.1);
  touch_with_whole_surface(scene);
  ObstacleOf<Dim> obstacle;
  obstacle.shape = shape;
  obstacle.place = vec<Dim>(0, 0.45, 0);
  scene.obstacles = {obstacle};
  return scene;
}
template <int Dim>
std::vector<SceneOf<Dim>> swallowed_in_each_shape() {
  const VectorOf<Dim> half = VectorOf<Dim>::Constant(0.45);
  return {swallowed<Dim>(BoxOf<Dim>{half}), swallowed<Dim>(Ball{0.45}), swallowed<Dim>(box_mesh<Dim>(half))};
}

template <int Dim>
StateOf<Dim> at_rest(const SceneOf<Dim>& scene) {
  return {scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
}

TYPED_TEST(WaysOut, LeadAWholeBodyOverOneSideAndKeepItWhole) {
  constexpr int Dim = TypeParam::kDim;
  for (const SceneOf<Dim>& scene : swallowed_in_each_shape<Dim>()) {
    for (const Method method : {Method::kExplicit, Method::kEuler}) {
      SCOPED_TRACE(std::to_string(scene.obstacles.front().shape.index()) + " by " + name_of(method));
      const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
      ImpulsesOf<Dim> impulses = make_impulses(scene);
      StateOf<Dim> state = at_rest(scene);
      double least = 1;
      for (int k = 0; k < 240; ++k) {
        ASSERT_EQ(stepper->step(1.0 / 120, passive(scene.body), nullptr, state, impulses), Termination::kDone);
        least = std::min(least, jacobians(scene.body, state.x).minCoeff());
      }
      EXPECT_GT(least, 0.5);
      EXPECT_LT(deepest_place(scene, state), 0.02 * size_of(scene.body));
      EXPECT_NEAR(volume(scene.body, state.x) / volume(scene.body, scene.body.rest), 1, 0.02);
    }
  }
}

TYPED_TEST(WaysOut, AreForBodiesThatWouldLeaveByOppositeSidesAlone) {
  constexpr int Dim = TypeParam::kDim;
  for (const double height : {-1.0, 0.25, 0.4, 0.48}) {  // of the bar above its place in the middle
    SceneOf<Dim> scene = swallowed<Dim>(BoxOf<Dim>{vec<Dim>(0.8, 0.45, 0.8)});
    StateOf<Dim> state = at_rest(scene);
    state.x.row(1).array() += height;
    WayOut<Dim> way(scene);
    way.choose(state);
    for (int p = 0; p < scene.contact_points.count(); ++p) EXPECT_FALSE(way.leads(0, p)) << height;
  }
}

TYPED_TEST(WaysOut, GoUpAndNotThroughWhatBarsThem) {
  constexpr int Dim = TypeParam::kDim;
  SceneOf<Dim> scene = swallowed<Dim>(BoxOf<Dim>{VectorOf<Dim>::Constant(0.45)});
  const auto normal_of = [&] {
    WayOut<Dim> way(scene);
    way.choose(at_rest(scene));
    VectorOf<Dim> normal;
    const VectorOf<Dim> place = scene.contact_points.of(scene.body.rest, 0);
    EXPECT_TRUE(way.leads(0, 0));
    const double gap = way.gap(0, VectorOf<Dim>::Zero(), place, -0.1, normal);
    EXPECT_NEAR(gap, normal.dot(place - scene.obstacles.front().place) - 0.45, 1e-12);
    return normal;
  };
  EXPECT_LT((normal_of() - VectorOf<Dim>::UnitY()).norm(), 1e-12);
  ObstacleOf<Dim> lid;
  lid.shape = BoxOf<Dim>{VectorOf<Dim>::Constant(0.3)};
  lid.place = vec<Dim>(0, 1.2, 0);
  scene.obstacles.push_back(lid);
  EXPECT_LT(std::abs(normal_of().y()), 1e-12);
}

TYPED_TEST(WaysOut, EndWhereAPlaceHasBeenOutside) {
  constexpr int Dim = TypeParam::kDim;
  const SceneOf<Dim> scene = swallowed<Dim>(BoxOf<Dim>{VectorOf<Dim>::Constant(0.45)});
  StateOf<Dim> state = at_rest(scene);
  WayOut<Dim> way(scene);
  way.choose(state);
  const StateOf<Dim> inside = state;
  state.x.row(1).array() += 0.5;  // the lower half is still inside
  way.let_go(state);
  way.let_go(inside);
  int led = 0;
  for (int p = 0; p < scene.contact_points.count(); ++p) {
    const bool was_outside = scene.contact_points.of(state.x, p).y() > 0.9;
    EXPECT_EQ(way.leads(0, p), !was_outside) << p;
    led += way.leads(0, p) ? 1 : 0;
  }
  EXPECT_GT(led, 0);
}

}  // namespace
}  // namespace hydrostat::physics::way_out_test

#include "physics/element_body.h"

#include <gtest/gtest.h>

#include "physics/internal_forces.h"
#include "tests/physics/element_method_scene.h"

namespace hydrostat::physics::element_body_test {
namespace {

constexpr double kDt = 1.0 / 240;

template <typename Dimension>
class ElementBody : public testing::Test {};
TYPED_TEST_SUITE(ElementBody, BothDimensions, DimensionName);

TYPED_TEST(ElementBody, IsFilledByItsTetsAndHasEveryPairOfNodesAsAnEdge) {
  constexpr int Dim = TypeParam::kDim;
  for (const Cut cut : cuts<Dim>()) {
    SCOPED_TRACE(name_of(cut));
    const Eigen::Matrix<double, Dim, 1> size = vec<Dim>(0.3, 0.2, 0.4);
    const ElementMesh<Dim> mesh = element_bar<Dim>(Eigen::Vector3i(3, 2, 2).head<Dim>(), size, cut);
    const BodyOf<Dim> body = make_body(mesh, ElementBodyOptions{});
    EXPECT_NEAR(volume(body, body.rest), size.prod(), 1e-14);
    EXPECT_NEAR(body.mass.sum(), 1000 * size.prod(), 1e-10);
    EXPECT_NEAR(jacobians(body, body.rest).minCoeff(), 1, 1e-12);
    for (int t = 0; t < body.tet_count(); ++t) {
      for (int a = 0, k = 0; a <= Dim; ++a) {
        for (int b = a + 1; b <= Dim; ++b, ++k) {
          const int e = body.tet_edges(k, t);
          EXPECT_EQ(std::minmax(body.tets(a, t), body.tets(b, t)), std::minmax(body.edges(0, e), body.edges(1, e)));
        }
      }
    }
    SceneOf<Dim> scene;
    scene.body = body;
    touch_with_whole_surface(scene);
    EXPECT_EQ(scene.contact_points.count(), Dim == 2 ? 10 : 34);  // all nodes but those inside
  }
}

TYPED_TEST(ElementBody, TellsWhatItsElementsWereMadeFrom) {
  constexpr int Dim = TypeParam::kDim;
  for_random_element_bodies<Dim>(2, [&](const BodyOf<Dim>& body, std::mt19937& random) {
    const BodyElements<Dim>& elements = body.elements.front();
    BodyOf<Dim> again = body;
    again.elements = {make_body_elements(mesh_of(body, elements), elements.block.law)};
    const PointsOf<Dim> x = body.rest + random_points<Dim>(random, body.node_count(), 0.02);
    PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, x.cols()), same = force;
    InternalForces<Dim>(body).add_elastic_forces(x, force);
    InternalForces<Dim>(again).add_elastic_forces(x, same);
    EXPECT_EQ(force, same);
    EXPECT_EQ(again.elements.front().fit.of_element, elements.fit.of_element);
  });
}

// What a stepper does with elements, whatever the method.
template <typename Case>
class ElementSteppers : public testing::Test {};
TYPED_TEST_SUITE(ElementSteppers, Cases, CaseName);

METHOD_TEST(ElementSteppers, KeepMomentumInFreeFlightWhateverTheActivation) {
  for_random_element_bodies<Dim>(2, [&](const BodyOf<Dim>& body, std::mt19937& random) {
    const SceneOf<Dim> scene = in_the_air(body, true);
    const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state{body.rest, random_points<Dim>(random, body.node_count(), 0.2)};
    const VectorOf<Dim> from = momentum(body, state.v);
    for (int k = 0; k < 24; ++k) {
      const Eigen::VectorXd activation = random_activation(random, body, 0.05);
      const long guarded = stepper->guard_steps();
      const SpinOf<Dim> before = angular_momentum(body, state.x, state.v, VectorOf<Dim>::Zero());
      ASSERT_EQ(stepper->step(kDt, activation, nullptr, state, impulses), Termination::kDone);
      const SpinOf<Dim> turned = angular_momentum(body, state.x, state.v, VectorOf<Dim>::Zero()) - before;
      if (stepper->guard_steps() != guarded) continue;  // backward Euler's loss
      EXPECT_LT((turned - impulses.gravity_moment).norm(), angular_tolerance(method) * body.mass.sum());
    }
    EXPECT_LT((momentum(body, state.v) - from - 24 * kDt * body.mass.sum() * scene.gravity).norm(), 1e-9 * body.mass.sum());
  });
}

METHOD_TEST(ElementSteppers, HoldACantileverAndBookWhatThatTakes) {
  SceneOf<Dim> scene = cantilever<Dim>(8, 2, Cut::kBoxes, {1000, 5e5, 0.4});
  BodyOf<Dim>& body = scene.body;
  body.edge_damping.setConstant(20);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  StateOf<Dim> state{body.rest, PointsOf<Dim>::Zero(Dim, body.node_count())};
  for (int k = 0; k < 60; ++k) {
    const VectorOf<Dim> before = momentum(body, state.v);
    ASSERT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);
    const VectorOf<Dim> booked = impulses.hold.rowwise().sum() + kDt * body.mass.sum() * scene.gravity;
    EXPECT_LT((momentum(body, state.v) - before - booked).norm(), 1e-6 * kDt * body.mass.sum() * 9.81);
    for (const int node : body.held) ASSERT_LT((state.x.col(node) - body.rest.col(node)).norm(), 1e-12);
  }
  EXPECT_LT(state.x.row(1).minCoeff(), -0.01);  // it falls at its end
}

METHOD_TEST(ElementSteppers, ContractAsTheyAreAskedTo) {
  // All lengths a tenth shorter is a shape that elements have without stress.
  for (const Cut cut : cuts<Dim>()) {
    BodyOf<Dim> body = make_body(element_bar<Dim>(Eigen::Matrix<int, Dim, 1>::Constant(2), VectorOf<Dim>::Constant(0.2), cut),
                                 {ElasticLaw::kStableNeoHookean, 0, 0.005});
    const SceneOf<Dim> scene = in_the_air(std::move(body), false);
    const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    for (int k = 0; k < 48; ++k) {
      ASSERT_EQ(stepper->step(kDt, 0.9 * passive(scene.body), nullptr, state, impulses), Termination::kDone);
    }
    EXPECT_NEAR(std::pow(volume(scene.body, state.x) / volume(scene.body, scene.body.rest), 1.0 / Dim), 0.9, 0.005);
  }
}

// CalculiX 2.20 (C3D4) on this mesh with E 5e7, nu 0.4 sags by 2.1133 mm at the end of the axis.
TEST(ElementStatics, SettledTetsSagAsCalculixSays) {
  const SceneOf<3> scene = cantilever<3>(8, 2, Cut::kSixTets, {1000, 5e7, 0.4});
  const std::unique_ptr<Stepper> stepper = make_euler_stepper(scene);
  Impulses impulses = make_impulses(scene);
  State state{scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count())};
  for (int k = 0; k < 40; ++k) {
    ASSERT_EQ(stepper->step(0.1, passive(scene.body), nullptr, state, impulses), Termination::kDone);
  }
  for (int i = 0; i < scene.body.node_count(); ++i) {
    const Eigen::Vector3d from_end = scene.body.rest.col(i) - Eigen::Vector3d(1, 0.125, 0.125);
    if (from_end.norm() > 1e-9) continue;
    EXPECT_NEAR((scene.body.rest(1, i) - state.x(1, i)) / 2.1133e-3, 1, 1e-3);
  }
}

}  // namespace
}  // namespace hydrostat::physics::element_body_test

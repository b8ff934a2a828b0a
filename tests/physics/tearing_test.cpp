#include "physics/tearing.h"

#include <gtest/gtest.h>

#include "tests/physics/seam_scene.h"

namespace hydrostat::physics::tearing_test {
namespace {

template <typename Dimension>
class Tearings : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Tearings, Dimensions);

template <int Dim>
SplitMesh<Dim> apart_of(const FractureOf<Dim>& fracture) {
  return split_mesh(fracture.mesh, fracture.faces, std::vector<char>(fracture.faces.size(), 1));
}

/// The tensions on a body that is stretched evenly along y; in the turned frame the same.
template <int Dim>
Eigen::VectorXd tensions_at(const FractureOf<Dim>& fracture, double stretch, double turn = 0) {
  const BodyOf<Dim> whole = fracture.make_body(fracture.mesh);
  SeamWatch<Dim> watch(fracture, whole, apart_of(fracture), false);
  PointsOf<Dim> x = whole.rest;
  x.row(1) *= stretch;
  BlockOf<Dim> rotation = BlockOf<Dim>::Identity();
  rotation.template topLeftCorner<2, 2>() << std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn);
  x = (rotation * x).eval();
  return watch.tensions(x, Eigen::VectorXd::Ones(whole.edge_count()), std::vector<char>(fracture.faces.size(), 0));
}

/// Of a stretch along y alone the stress is the derivative of the energy by it, over the volume: the area stays.
template <int Dim>
double stress_at(const FractureOf<Dim>& fracture, double stretch) {
  const BodyOf<Dim> whole = fracture.make_body(fracture.mesh);
  const InternalForces<Dim> forces(whole);
  const auto energy = [&](double at) {
    PointsOf<Dim> x = whole.rest;
    x.row(1) *= at;
    return forces.elastic_energy(x);
  };
  return (energy(stretch + 1e-5) - energy(stretch - 1e-5)) / (2e-5 * whole.rest_volume.sum());
}

TYPED_TEST(Tearings, MeasureTheStressOfAnEvenStretchOnEveryFace) {
  constexpr int Dim = TypeParam::value;
  for (const bool of_boxes : {false, true}) {
    for (const double offset : {0.0, 0.1}) {
      const FractureOf<Dim> fracture = fracture_of<Dim>(bar_mesh<Dim>(2, of_boxes), {level_seam<Dim>(offset)});
      for (const double stretch : {0.9, 1.0, 1.05, 1.3}) {
        SCOPED_TRACE(std::to_string(of_boxes) + " at " + std::to_string(stretch));
        const double stress = stress_at(fracture, stretch);
        for (const double turn : {0.0, 0.7}) {
          const Eigen::VectorXd tension = tensions_at(fracture, stretch, turn);
          EXPECT_LT((tension.array() - stress).abs().maxCoeff(), 1e-5 * std::abs(stress) + 1e-3);
        }
      }
    }
  }
}

/// A plane through the middle of cells of simplices is no plane in the mesh.
TYPED_TEST(Tearings, MeasureItOnAZigzagToo) {
  constexpr int Dim = TypeParam::value;
  const FractureOf<Dim> fracture = fracture_of<Dim>(bar_mesh<Dim>(3, false), {level_seam<Dim>(0.011)});
  const double stress = stress_at(fracture, 1.05);
  for (const double turn : {0.0, 2.0}) {
    EXPECT_LT((tensions_at(fracture, 1.05, turn).array() - stress).abs().maxCoeff(), 1e-5 * stress);
  }
}

TYPED_TEST(Tearings, KeepMomentumAndEnergyOverASplit) {
  constexpr int Dim = TypeParam::value;
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeamOf<Dim> seam = level_seam<Dim>(0.02, 1e3);
    seam.normal = (VectorOf<Dim>::UnitY() + random_points<Dim>(seed, 1, 0.6)).normalized();
    const FractureOf<Dim> fracture = fracture_of<Dim>(bar_mesh<Dim>(2, seed % 2 == 1), {seam});
    SceneOf<Dim> scene;
    scene.body = fracture.make_body(fracture.mesh);
    const int count = scene.body.node_count();
    StateOf<Dim> state{scene.body.rest + random_points<Dim>(seed + 100, count, 0.01), random_points<Dim>(seed + 200, count, 2)};
    state.x.row(1) *= 1.2;
    const Eigen::VectorXd activation = Eigen::VectorXd::Constant(scene.body.edge_count(), 0.97);
    const VectorOf<Dim> origin = VectorOf<Dim>::Zero();
    const auto energy = [&](const BodyOf<Dim>& body, const Eigen::VectorXd& activations) {
      InternalForces<Dim> forces(body);
      forces.set_activation(activations);
      return forces.elastic_energy(state.x) + 0.5 * state.v.colwise().squaredNorm().dot(body.mass);
    };
    const double mass = scene.body.mass.sum(), energy_before = energy(scene.body, activation);
    const VectorOf<Dim> momentum_before = momentum(scene.body, state.v);
    const SpinOf<Dim> spin_before = angular_momentum(scene.body, state.x, state.v, origin);
    Tearing<Dim> tearing(fracture, scene.body, false);
    ASSERT_FALSE(tearing.break_loaded(state, activation).empty());
    ASSERT_TRUE(tearing.split(scene, state));
    ASSERT_GT(scene.body.node_count(), count);
    EXPECT_NEAR(scene.body.mass.sum(), mass, 1e-12 * mass);
    EXPECT_LT((momentum(scene.body, state.v) - momentum_before).norm(), 1e-12 * mass);
    EXPECT_LT((angular_momentum(scene.body, state.x, state.v, origin) - spin_before).norm(), 1e-12 * mass);
    EXPECT_NEAR(energy(scene.body, activation(tearing.edges_now())), energy_before, 1e-10 * energy_before);
    EXPECT_NEAR(tearing.mass_share().dot(scene.body.mass(tearing.node_now())), mass, 1e-12 * mass);
  }
}

TYPED_TEST(Tearings, BreakUnderTensionAndNeverUnderPressure) {
  constexpr int Dim = TypeParam::value;
  const FractureOf<Dim> weak = fracture_of<Dim>(bar_mesh<Dim>(2, false), {level_seam<Dim>(0, 1e-3)});
  for (const double stretch : {0.5, 0.9, 0.999, 1.001}) {
    SceneOf<Dim> scene;
    scene.body = weak.make_body(weak.mesh);
    StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    state.x.row(1) *= stretch;
    Tearing<Dim> tearing(weak, scene.body, false);
    EXPECT_EQ(tearing.break_loaded(state, Eigen::VectorXd::Ones(scene.body.edge_count())).empty(), stretch < 1) << stretch;
    EXPECT_EQ(tearing.split(scene, state), stretch > 1);
    EXPECT_EQ(tearing.part_count(), stretch > 1 ? 2 : 1);
  }
}

/// What is left of a seam bears what all of it bore before.
TYPED_TEST(Tearings, LeaveTheLoadToWhatIsNotBroken) {
  constexpr int Dim = TypeParam::value;
  const FractureOf<Dim> fracture = fracture_of<Dim>(bar_mesh<Dim>(4, false), {level_seam<Dim>(0)});
  const BodyOf<Dim> whole = fracture.make_body(fracture.mesh);
  SeamWatch<Dim> watch(fracture, whole, apart_of(fracture), false);
  PointsOf<Dim> x = whole.rest;
  x.row(1) *= 1.1;
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(whole.edge_count());
  std::vector<char> is_broken(fracture.faces.size(), 0);
  const double before = watch.tensions(x, passive, is_broken).maxCoeff();
  is_broken[0] = 1;
  const Eigen::VectorXd after = watch.tensions(x, passive, is_broken);
  EXPECT_EQ(after[0], 0);
  EXPECT_GT(after.maxCoeff(), 1.05 * before);
}

/// An activated body that is held where it is is in tension.
TYPED_TEST(Tearings, FeelActivation) {
  constexpr int Dim = TypeParam::value;
  const FractureOf<Dim> fracture = fracture_of<Dim>(bar_mesh<Dim>(2, false), {level_seam<Dim>(0)});
  const BodyOf<Dim> whole = fracture.make_body(fracture.mesh);
  SeamWatch<Dim> watch(fracture, whole, apart_of(fracture), false);
  const std::vector<char> is_broken(fracture.faces.size(), 0);
  EXPECT_NEAR(watch.tensions(whole.rest, Eigen::VectorXd::Ones(whole.edge_count()), is_broken).cwiseAbs().maxCoeff(), 0, 1e-6);
  EXPECT_GT(watch.tensions(whole.rest, Eigen::VectorXd::Constant(whole.edge_count(), 0.9), is_broken).minCoeff(), 1e4);
}

}  // namespace
}  // namespace hydrostat::physics::tearing_test

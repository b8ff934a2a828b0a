#include "physics/internal_forces.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "tests/physics/element_method_scene.h"

namespace hydrostat::physics::internal_forces_test {
namespace {

constexpr unsigned kSeeds = 3;

template <typename Dimension>
class Internal : public testing::Test {};
TYPED_TEST_SUITE(Internal, BothDimensions, DimensionName);

template <int Dim>
PointsOf<Dim> shaken(const BodyOf<Dim>& body, std::mt19937& random, double amplitude = 0.02) {
  return random_rotation<Dim>(random) * body.rest + random_points<Dim>(random, body.node_count(), amplitude);
}

TYPED_TEST(Internal, ForceIsMinusTheGradientOfEnergyAtEveryActivation) {
  constexpr int Dim = TypeParam::kDim;
  for_random_element_bodies<Dim>(kSeeds, [](const BodyOf<Dim>& body, std::mt19937& random) {
    InternalForces<Dim> forces(body);
    ASSERT_TRUE(forces.set_activation(random_activation(random, body, 0.2)));
    const PointsOf<Dim> x = shaken(body, random);
    PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, x.cols());
    forces.add_elastic_forces(x, force);
    const PointsOf<Dim> slope = slope_of(x, 1e-6, [&](const PointsOf<Dim>& at) { return forces.elastic_energy(at); });
    EXPECT_LT((force + slope).norm(), 1e-6 * force.norm());
  });
}

TYPED_TEST(Internal, ForcesHaveNeitherSumNorMomentAndTurnWithTheBody) {
  constexpr int Dim = TypeParam::kDim;
  for_random_element_bodies<Dim>(kSeeds, [](const BodyOf<Dim>& body, std::mt19937& random) {
    InternalForces<Dim> forces(body);
    ASSERT_TRUE(forces.set_activation(random_activation(random, body, 0.2)));
    StateOf<Dim> state{shaken(body, random), random_points<Dim>(random, body.node_count(), 1)};
    PointsOf<Dim> force = PointsOf<Dim>::Zero(Dim, body.node_count()), turned = force;
    forces.add_forces(state, force);
    SpinOf<Dim> moment = SpinOf<Dim>::Zero();
    for (int i = 0; i < body.node_count(); ++i) moment += cross<Dim>(state.x.col(i), force.col(i));
    EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * force.norm());
    EXPECT_LT(moment.norm(), 1e-12 * force.norm());
    const BlockOf<Dim> turn = random_rotation<Dim>(random);
    state.x = (turn * state.x).eval();
    state.v = (turn * state.v).eval();
    forces.add_forces(state, turned);
    EXPECT_LT((turned - turn * force).norm(), 1e-10 * force.norm());
  });
}

TYPED_TEST(Internal, ActivationsPushAndPullAsForceAndEnergyChangeWithThem) {
  constexpr int Dim = TypeParam::kDim;
  const auto expect = [](const BodyOf<Dim>& body, std::mt19937& random) {
    InternalForces<Dim> forces(body);
    const Eigen::VectorXd activation = random_activation(random, body, 0.2);
    const PointsOf<Dim> x = shaken(body, random);
    ASSERT_TRUE(forces.set_activation(activation));
    const Eigen::VectorXd push = forces.force_per_activation(x) * Eigen::VectorXd::LinSpaced(body.edge_count(), -1, 1);
    const Eigen::VectorXd tensions = forces.tensions(x);
    constexpr double kStep = 1e-6;
    PointsOf<Dim> ahead = PointsOf<Dim>::Zero(Dim, body.node_count()), behind = ahead;
    const Eigen::VectorXd change = kStep * Eigen::VectorXd::LinSpaced(body.edge_count(), -1, 1);
    ASSERT_TRUE(forces.set_activation(activation + change));
    forces.add_elastic_forces(x, ahead);
    const double energy_ahead = forces.elastic_energy(x);
    ASSERT_TRUE(forces.set_activation(activation - change));
    forces.add_elastic_forces(x, behind);
    const double slope = (energy_ahead - forces.elastic_energy(x)) / (2 * kStep);
    EXPECT_LT((push - (ahead - behind).reshaped() / (2 * kStep)).norm(), 1e-6 * push.norm());
    const double work = -tensions.cwiseProduct(body.rest_length).dot(change) / kStep;
    EXPECT_NEAR(work, slope, 1e-6 * tensions.cwiseProduct(body.rest_length).norm());
  };
  for_random_element_bodies<Dim>(kSeeds, expect);
  for (unsigned seed = 0; seed < trials(kSeeds); ++seed) {
    std::mt19937 random(seed);
    expect(random_body<Dim>(seed), random);
  }
}

TYPED_TEST(Internal, StiffnessAtRestIsTheDerivativeOfTheForces) {
  constexpr int Dim = TypeParam::kDim;
  for_random_element_bodies<Dim>(kSeeds, [](const BodyOf<Dim>& body, std::mt19937& random) {
    InternalForces<Dim> forces(body);
    SystemMatrixOf<Dim> matrix(body);
    matrix.set_zero();
    forces.add_stiffness(body.rest, 2, matrix);
    const PointsOf<Dim> direction = random_points<Dim>(random, body.node_count(), 1);
    constexpr double kStep = 1e-7;
    PointsOf<Dim> ahead = PointsOf<Dim>::Zero(Dim, body.node_count()), behind = ahead;
    forces.add_elastic_forces(body.rest + kStep * direction, ahead);
    forces.add_elastic_forces(body.rest - kStep * direction, behind);
    const Eigen::VectorXd expected = (behind - ahead).reshaped() / kStep;
    const Eigen::VectorXd product = matrix.lower().template selfadjointView<Eigen::Lower>() * direction.reshaped().eval();
    EXPECT_LT((product - expected).norm(), 1e-6 * expected.norm());
  });
}

TYPED_TEST(Internal, StiffeningBoundsWhatAStrainedBodysFrequenciesGrowBy) {
  constexpr int Dim = TypeParam::kDim;
  const auto highest = [](const BodyElements<Dim>& elements, const PointsOf<Dim>& x, const ActiveStrain<Dim>& active) {
    return highest_frequency<Dim>(elements.block, x, &active);
  };
  for_random_element_bodies<Dim>(2, [&](const BodyOf<Dim>& body, std::mt19937& random) {
    const BodyElements<Dim>& elements = body.elements.front();
    ActiveStrain<Dim> active = make_active_strain(elements.block);
    const double at_rest = highest(elements, body.rest, active);
    for (const double stretch : {0.6, 0.8, 1.3, 1.8}) {
      const Eigen::VectorXd activation = random_activation(random, body, 0.2);
      InternalForces<Dim> forces(body);
      ASSERT_TRUE(forces.set_activation(activation) && set_activation(elements.fit, activation, active));
      PointsOf<Dim> x = body.rest;
      x.row(0) *= stretch;
      const double growth = highest(elements, x, active) / at_rest;
      EXPECT_LT(growth * growth, 1.3 * forces.stiffening(x)) << "stretch " << stretch;  // an explicit step has that to spare
    }
  });
}

TYPED_TEST(Internal, AnActivationThatHasNoShapeIsRefusedAndTheNextOneTaken) {
  constexpr int Dim = TypeParam::kDim;
  const BodyOf<Dim> body = random_element_body<Dim>(1, Cut::kBoxes, ElasticLaw::kStableNeoHookean);
  InternalForces<Dim> forces(body);
  const double at_rest = forces.elastic_energy(body.rest);
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    EXPECT_FALSE(forces.set_activation(Eigen::VectorXd::Constant(body.edge_count(), bad)));
    EXPECT_FALSE(forces.set_activation(Eigen::VectorXd::Constant(body.edge_count(), bad)));
  }
  EXPECT_TRUE(forces.set_activation(Eigen::VectorXd::Constant(body.edge_count(), 1.1)));
  EXPECT_GT(forces.elastic_energy(body.rest), at_rest);
  EXPECT_TRUE(forces.set_activation(passive(body)));
  EXPECT_NEAR(forces.elastic_energy(body.rest), at_rest, 1e-12);
}

}  // namespace
}  // namespace hydrostat::physics::internal_forces_test

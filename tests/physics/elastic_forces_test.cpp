#include "physics/elastic_forces.h"

#include <gtest/gtest.h>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics::elastic_forces_test {
namespace {

constexpr unsigned kSeeds = trials(30);

template <int Dim>
struct Deformed {
  BodyOf<Dim> body;
  StateOf<Dim> state;
  Eigen::VectorXd activation;
  PointsOf<Dim> force;
};

template <int Dim>
Deformed<Dim> deformed(unsigned seed) {
  std::mt19937 random(seed);
  Deformed<Dim> d{random_body<Dim>(seed), {}, {}, {}};
  d.state.x = d.body.rest + random_points<Dim>(random, d.body.node_count(), 0.03);
  d.state.v = random_points<Dim>(random, d.body.node_count(), 2);
  d.activation = random_activation(random, d.body, 0.4);
  d.force = PointsOf<Dim>::Zero(Dim, d.body.node_count());
  return d;
}

template <int Dim>
SpinOf<Dim> moment(const PointsOf<Dim>& x, const PointsOf<Dim>& force) {
  SpinOf<Dim> sum = SpinOf<Dim>::Zero();
  for (Eigen::Index i = 0; i < x.cols(); ++i) sum += cross<Dim>(x.col(i), force.col(i));
  return sum;
}

template <typename Dimension>
class ElasticForces : public testing::Test {};
TYPED_TEST_SUITE(ElasticForces, BothDimensions, DimensionName);

TYPED_TEST(ElasticForces, AreMinusTheGradientOfEnergy) {
  constexpr int Dim = TypeParam::kDim;
  constexpr double kStep = 1e-6;  // [m]
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Deformed<Dim> d = deformed<Dim>(seed);
    add_elastic_forces(d.body, d.state.x, d.activation, d.force);
    PointsOf<Dim> slope(Dim, d.body.node_count()), x = d.state.x;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double here = x.reshaped()[k];
      x.reshaped()[k] = here + kStep;
      const double ahead = elastic_energy(d.body, x, d.activation);
      x.reshaped()[k] = here - kStep;
      slope.reshaped()[k] = (ahead - elastic_energy(d.body, x, d.activation)) / (2 * kStep);
      x.reshaped()[k] = here;
    }
    EXPECT_LT((d.force + slope).norm(), 1e-7 * d.force.norm());
  }
}

TYPED_TEST(ElasticForces, AreNoneInTheRestShape) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Deformed<Dim> d = deformed<Dim>(seed);
    const PointsOf<Dim> moved = (random_rotation<Dim>(random) * d.body.rest).colwise() + vec<Dim>(1, -2, 3);
    const Eigen::VectorXd ones = passive(d.body);
    add_elastic_forces(d.body, moved, ones, d.force);
    EXPECT_LT(d.force.cwiseAbs().maxCoeff(), 1e-8);  // [N], where 1 % of strain gives some 100
    EXPECT_LT(elastic_energy(d.body, moved, ones), 1e-18);
  }
}

TYPED_TEST(ElasticForces, AreLinearInActivation) {
  constexpr int Dim = TypeParam::kDim;
  Deformed<Dim> d = deformed<Dim>(3);
  const Eigen::VectorXd ones = passive(d.body);
  PointsOf<Dim> at_one = d.force, at_half = d.force;
  add_elastic_forces(d.body, d.state.x, d.activation, d.force);
  add_elastic_forces(d.body, d.state.x, ones, at_one);
  add_elastic_forces(d.body, d.state.x, 0.5 * (ones + d.activation), at_half);
  EXPECT_LT((at_half - 0.5 * (at_one + d.force)).norm(), 1e-12 * d.force.norm());
}

TYPED_TEST(ElasticForces, AndDashpotsSumToNothingAndHaveNoMoment) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Deformed<Dim> d = deformed<Dim>(seed);
    add_internal_forces(d.body, d.state, d.activation, d.force);
    EXPECT_LT(d.force.rowwise().sum().norm(), 1e-12 * d.force.norm());
    EXPECT_LT(moment<Dim>(d.state.x, d.force).norm(), 1e-12 * d.force.norm() * d.state.x.norm());
  }
}

TYPED_TEST(ElasticForces, AndDashpotsAreTheInternalForces) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Deformed<Dim> d = deformed<Dim>(seed);
    PointsOf<Dim> parts = d.force;
    add_internal_forces(d.body, d.state, d.activation, d.force);
    add_elastic_forces(d.body, d.state.x, d.activation, parts);
    add_damping_forces(d.body, d.state.x, d.state.v, parts);
    EXPECT_LT((d.force - parts).norm(), 1e-12 * parts.norm());
  }
}

/// The body with but some of its edges and tets.
template <int Dim>
BodyOf<Dim> part_of(BodyOf<Dim> body, Eigen::Index first_edge, Eigen::Index edges, Eigen::Index first_tet, Eigen::Index tets) {
  const auto keep = [](auto& numbers, Eigen::Index first, Eigen::Index count) {
    const auto kept = numbers.middleCols(first, count).eval();
    numbers = kept;
  };
  const auto keep_rows = [](Eigen::VectorXd& numbers, Eigen::Index first, Eigen::Index count) {
    numbers = numbers.segment(first, count).eval();
  };
  keep(body.edges, first_edge, edges);
  for (Eigen::VectorXd* numbers : {&body.rest_length, &body.edge_stiffness, &body.edge_damping}) keep_rows(*numbers, first_edge, edges);
  keep(body.tets, first_tet, tets);
  for (Eigen::VectorXd* numbers : {&body.rest_volume, &body.volume_stiffness}) keep_rows(*numbers, first_tet, tets);
  return body;
}

TYPED_TEST(ElasticForces, AreTheSumOverEdgesAndTetsHoweverManyThereAre) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < 3; ++seed) {
    const Deformed<Dim> d = deformed<Dim>(seed);
    for (Eigen::Index count = 0; count < std::min<Eigen::Index>(10, d.body.tet_count()); ++count) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(count));
      PointsOf<Dim> together = d.force, one_by_one = d.force;
      const Eigen::VectorXd activation = d.activation.segment(seed, count);
      add_internal_forces(part_of<Dim>(d.body, seed, count, 0, count), d.state, activation, together);
      for (Eigen::Index k = 0; k < count; ++k) {
        const BodyOf<Dim> one = part_of<Dim>(d.body, seed + k, 1, k, 1);
        add_internal_forces(one, d.state, activation.segment(k, 1), one_by_one);
      }
      EXPECT_EQ(together.isZero(0), count == 0);
      EXPECT_LE((together - one_by_one).norm(), 1e-13 * one_by_one.norm());
      const Eigen::VectorXd sum = together.rowwise().sum();
      EXPECT_LE(sum.norm(), 1e-13 * together.norm());
    }
  }
}

TYPED_TEST(ElasticForces, AreNoNumberWhereAPlaceIsNone) {
  constexpr int Dim = TypeParam::kDim;
  Deformed<Dim> d = deformed<Dim>(2);
  const int node = d.body.edges(0, d.body.edge_count() / 2);
  d.state.x(1, node) = std::nan("");
  add_internal_forces(d.body, d.state, d.activation, d.force);
  EXPECT_TRUE(d.force.col(node).hasNaN());
}

TYPED_TEST(ElasticForces, LeaveItToDashpotsToBrakeAllButRigidMotion) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Deformed<Dim> d = deformed<Dim>(seed);
    const PointsOf<Dim> rigid = rigid_velocity<Dim>(d.body, d.state.x, vec<Dim>(1, 2, 3), random_spin<Dim>(random, 5));
    PointsOf<Dim> of_rigid = d.force;
    add_damping_forces(d.body, d.state.x, rigid, of_rigid);
    add_damping_forces(d.body, d.state.x, d.state.v, d.force);
    EXPECT_LT(of_rigid.norm(), 1e-12 * d.force.norm());
    EXPECT_LT(d.force.cwiseProduct(d.state.v).sum(), 0);
  }
}

TYPED_TEST(ElasticForces, OfDashpotsTakeTwiceTheirPotential) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Deformed<Dim> d = deformed<Dim>(seed);
    add_damping_forces<Dim>(d.body, d.state.x, d.state.v, d.force);
    const PointsOf<Dim> to = d.body.rest + d.state.v;
    const double taken = -d.force.cwiseProduct(d.state.v).sum();
    EXPECT_GT(taken, 0);
    EXPECT_NEAR(2 * damping_potential<Dim>(d.body, d.state.x, d.body.rest, to) / taken, 1, 1e-12) << "seed " << seed;
  }
}

TYPED_TEST(ElasticForces, HaveAnEnergyThatDoesNotChangeWhenTheBodyIsTurnedAndMoved) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Deformed<Dim> d = deformed<Dim>(seed);
    const PointsOf<Dim> moved = (random_rotation<Dim>(random) * d.state.x).colwise() + vec<Dim>(-0.5, 2, 1);
    const double energy = elastic_energy(d.body, d.state.x, d.activation);
    EXPECT_NEAR(elastic_energy(d.body, moved, d.activation) / energy, 1, 1e-12);
  }
}

TYPED_TEST(ElasticForces, AreFiniteForAFlatAndForACollapsedBody) {
  constexpr int Dim = TypeParam::kDim;
  Deformed<Dim> d = deformed<Dim>(1);
  PointsOf<Dim> flat = d.body.rest;
  flat.row(1).setZero();
  for (const PointsOf<Dim>& x : {flat, PointsOf<Dim>(0 * flat)}) {
    d.state.x = x;
    add_internal_forces(d.body, d.state, d.activation, d.force);
    add_elastic_forces(d.body, x, d.activation, d.force);
    add_damping_forces(d.body, x, d.state.v, d.force);
    EXPECT_TRUE(d.force.allFinite());
  }
}

}  // namespace
}  // namespace hydrostat::physics::elastic_forces_test

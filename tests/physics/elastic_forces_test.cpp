#include "physics/elastic_forces.h"

#include <gtest/gtest.h>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics {
namespace {

constexpr unsigned kSeeds = 30;

struct Deformed {
  Body body;
  State state;
  Eigen::VectorXd activation;
  Eigen::Matrix3Xd force;
};

Deformed deformed(unsigned seed) {
  std::mt19937 random(seed);
  Deformed d{random_body(seed), {}, {}, {}};
  d.state.x = d.body.rest + random_points(random, d.body.node_count(), 0.03);
  d.state.v = random_points(random, d.body.node_count(), 2);
  d.activation = random_activation(random, d.body, 0.4);
  d.force = Eigen::Matrix3Xd::Zero(3, d.body.node_count());
  return d;
}

Eigen::Vector3d moment(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& force) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < x.cols(); ++i) sum += x.col(i).cross(force.col(i));
  return sum;
}

TEST(AddElasticForces, ForceIsMinusTheGradientOfEnergy) {
  constexpr double kStep = 1e-6;  // [m]
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Deformed d = deformed(seed);
    add_elastic_forces(d.body, d.state.x, d.activation, d.force);
    Eigen::Matrix3Xd slope(3, d.body.node_count()), x = d.state.x;
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

TEST(AddElasticForces, RestShapeHasNoStress) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Deformed d = deformed(seed);
    const Eigen::Matrix3Xd moved = (random_rotation(random) * d.body.rest).colwise() + Eigen::Vector3d(1, -2, 3);
    const Eigen::VectorXd passive = Eigen::VectorXd::Ones(d.body.edge_count());
    add_elastic_forces(d.body, moved, passive, d.force);
    EXPECT_LT(d.force.cwiseAbs().maxCoeff(), 1e-8);  // [N], where 1 % of strain gives some 100
    EXPECT_LT(elastic_energy(d.body, moved, passive), 1e-18);
  }
}

TEST(AddElasticForces, ForceIsLinearInActivation) {
  Deformed d = deformed(3);
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(d.body.edge_count());
  Eigen::Matrix3Xd at_one = d.force, at_half = d.force;
  add_elastic_forces(d.body, d.state.x, d.activation, d.force);
  add_elastic_forces(d.body, d.state.x, passive, at_one);
  add_elastic_forces(d.body, d.state.x, 0.5 * (passive + d.activation), at_half);
  EXPECT_LT((at_half - 0.5 * (at_one + d.force)).norm(), 1e-12 * d.force.norm());
}

TEST(AddInternalForces, SumToNothingAndHaveNoMoment) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Deformed d = deformed(seed);
    add_internal_forces(d.body, d.state, d.activation, d.force);
    EXPECT_LT(d.force.rowwise().sum().norm(), 1e-12 * d.force.norm());
    EXPECT_LT(moment(d.state.x, d.force).norm(), 1e-12 * d.force.norm() * d.state.x.norm());
  }
}

TEST(AddInternalForces, AreElasticForcesAndDashpots) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Deformed d = deformed(seed);
    Eigen::Matrix3Xd parts = d.force;
    add_internal_forces(d.body, d.state, d.activation, d.force);
    add_elastic_forces(d.body, d.state.x, d.activation, parts);
    add_damping_forces(d.body, d.state.x, d.state.v, parts);
    EXPECT_LT((d.force - parts).norm(), 1e-12 * parts.norm());
  }
}

TEST(AddDampingForces, LeaveRigidMotionAloneAndTakeEnergyFromAllElse) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Deformed d = deformed(seed);
    const Eigen::Vector3d rate = random_points(random, 1, 5);
    Eigen::Matrix3Xd rigid(3, d.body.node_count());
    for (int i = 0; i < d.body.node_count(); ++i) rigid.col(i) = Eigen::Vector3d(1, 2, 3) + rate.cross(d.state.x.col(i));
    Eigen::Matrix3Xd of_rigid = d.force;
    add_damping_forces(d.body, d.state.x, rigid, of_rigid);
    add_damping_forces(d.body, d.state.x, d.state.v, d.force);
    EXPECT_LT(of_rigid.norm(), 1e-12 * d.force.norm());
    EXPECT_LT(d.force.cwiseProduct(d.state.v).sum(), 0);
  }
}

TEST(ElasticEnergy, DoesNotChangeWhenTheBodyIsTurnedAndMoved) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Deformed d = deformed(seed);
    const Eigen::Matrix3Xd moved = (random_rotation(random) * d.state.x).colwise() + Eigen::Vector3d(-0.5, 2, 1);
    const double energy = elastic_energy(d.body, d.state.x, d.activation);
    EXPECT_NEAR(elastic_energy(d.body, moved, d.activation) / energy, 1, 1e-12);
  }
}

TEST(AddElasticForces, AreFiniteForAFlatAndForACollapsedBody) {
  Deformed d = deformed(1);
  Eigen::Matrix3Xd flat = d.body.rest;
  flat.row(1).setZero();
  for (const Eigen::Matrix3Xd& x : {flat, Eigen::Matrix3Xd(0 * flat)}) {
    d.state.x = x;
    add_internal_forces(d.body, d.state, d.activation, d.force);
    add_elastic_forces(d.body, x, d.activation, d.force);
    add_damping_forces(d.body, x, d.state.v, d.force);
    EXPECT_TRUE(d.force.allFinite());
  }
}

}  // namespace
}  // namespace hydrostat::physics

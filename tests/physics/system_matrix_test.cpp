#include "physics/system_matrix.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "physics/elastic_forces.h"
#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics {
namespace {

Eigen::MatrixXd dense(const SystemMatrix& matrix) {
  return Eigen::MatrixXd(Eigen::MatrixXd(matrix.lower()).selfadjointView<Eigen::Lower>());
}

SystemMatrix zero_matrix(const Body& body) {
  SystemMatrix matrix(body);
  matrix.set_zero();
  return matrix;
}

/// -d force / d x by central differences.
template <typename Force>
Eigen::MatrixXd negative_slope(const Force& force, Eigen::Matrix3Xd x, double step) {
  Eigen::MatrixXd slope(x.size(), x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const double here = x.reshaped()[k];
    x.reshaped()[k] = here + step;
    const Eigen::Matrix3Xd ahead = force(x);
    x.reshaped()[k] = here - step;
    slope.col(k) = (force(x) - ahead).reshaped() / (2 * step);
    x.reshaped()[k] = here;
  }
  return slope;
}

TEST(SystemMatrix, StiffnessIsTheHessianAtRest) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Body body = random_body(seed);
    const Eigen::VectorXd passive = Eigen::VectorXd::Ones(body.edge_count());
    SystemMatrix matrix = zero_matrix(body);
    matrix.add_stiffness(body, body.rest, passive, 1);
    const auto force = [&](const Eigen::Matrix3Xd& x) {
      Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, x.cols());
      add_elastic_forces(body, x, passive, sum);
      return sum;
    };
    const Eigen::MatrixXd expected = negative_slope(force, body.rest, 1e-6);
    EXPECT_LT((dense(matrix) - expected).norm(), 1e-7 * expected.norm());
  }
}

TEST(SystemMatrix, DampingIsTheSlopeOfTheDashpots) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Body body = random_body(seed);
    const Eigen::Matrix3Xd x = body.rest + random_points(random, body.node_count(), 0.03);
    SystemMatrix matrix = zero_matrix(body);
    matrix.add_damping(body, x, 1);
    const auto force = [&](const Eigen::Matrix3Xd& v) {
      Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, v.cols());
      add_damping_forces(body, x, v, sum);
      return sum;
    };
    const Eigen::MatrixXd expected = negative_slope(force, random_points(random, body.node_count(), 1), 1e-3);
    EXPECT_LT((dense(matrix) - expected).norm(), 1e-9 * expected.norm());
  }
}

TEST(SystemMatrix, IsPositiveSemiDefiniteInAnyState) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Body body = random_body(seed);
    const Eigen::Matrix3Xd x = body.rest + random_points(random, body.node_count(), 0.1);  // inverted tets among them
    SystemMatrix matrix = zero_matrix(body);
    matrix.add_stiffness(body, x, random_activation(random, body, 0.4), 1);
    const Eigen::VectorXd eigenvalues =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(matrix), Eigen::EigenvaluesOnly).eigenvalues();
    EXPECT_GT(eigenvalues.minCoeff(), -1e-12 * eigenvalues.maxCoeff());
  }
}

TEST(SystemMatrix, ContactIsASpringAtTheEmbeddedPoint) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Body body = random_body(seed);
    ContactPoints points;
    points.nodes = body.tets.col(static_cast<Eigen::Index>(seed) % body.tet_count());
    points.weights = Eigen::Vector4d(0.1, 0.2, 0.3, 0.4);
    const Eigen::Matrix3d half = random_points(random, 3, 1), block = half * half.transpose();
    SystemMatrix matrix = zero_matrix(body);
    matrix.add_contact(points, 0, block);
    Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(3, 3 * body.node_count());
    for (int k = 0; k < 4; ++k)
      weights.middleCols<3>(3 * points.nodes(k, 0)) = points.weights(k, 0) * Eigen::Matrix3d::Identity();
    const Eigen::MatrixXd expected = weights.transpose() * block * weights;
    EXPECT_LT((dense(matrix) - expected).norm(), 1e-14);
  }
}

TEST(SystemMatrix, SolvesForSeveralColumnsAtOnce) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Body body = seed == 0 ? four_legged() : random_body(seed);
    const double dt = 1.0 / 240;
    SystemMatrix matrix = zero_matrix(body);
    matrix.add_mass(body, 1 / (dt * dt));
    matrix.add_stiffness(body, body.rest + random_points(random, body.node_count(), 0.02),
                         random_activation(random, body, 0.3), 1);
    matrix.add_damping(body, body.rest, 1 / dt);
    ASSERT_TRUE(matrix.factor());
    const Eigen::MatrixXd wanted = random_points(random, body.node_count() * 5, 1).reshaped(3 * body.node_count(), 5);
    Eigen::MatrixXd columns = matrix.lower().selfadjointView<Eigen::Lower>() * wanted;
    matrix.solve_in_place(columns);
    EXPECT_LT((columns - wanted).norm(), 1e-11 * wanted.norm());
    Eigen::VectorXd one = matrix.lower().selfadjointView<Eigen::Lower>() * wanted.col(2);
    matrix.solve_in_place(one);
    EXPECT_LT((one - wanted.col(2)).norm(), 1e-11 * wanted.norm());
  }
}

TEST(SystemMatrix, RefusesToFactorWhatIsNotPositiveDefiniteAndRecovers) {
  const Body body = random_body(2);
  SystemMatrix matrix = zero_matrix(body);
  matrix.add_mass(body, -1);
  EXPECT_FALSE(matrix.factor());
  matrix.set_zero();
  matrix.add_mass(body, 1);
  ASSERT_TRUE(matrix.factor());
  Eigen::VectorXd column = Eigen::VectorXd::Ones(matrix.size());
  matrix.solve_in_place(column);
  EXPECT_LT((column.reshaped(3, body.node_count()).row(0).transpose() - body.mass.cwiseInverse()).norm(), 1e-12);
}

}  // namespace
}  // namespace hydrostat::physics

#include "physics/system_matrix.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "physics/elastic_forces.h"
#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics::system_matrix_test {
namespace {

template <int Dim>
Eigen::MatrixXd dense(const SystemMatrixOf<Dim>& matrix) {
  return Eigen::MatrixXd(Eigen::MatrixXd(matrix.lower()).selfadjointView<Eigen::Lower>());
}

template <int Dim>
SystemMatrixOf<Dim> zero_matrix(const BodyOf<Dim>& body) {
  SystemMatrixOf<Dim> matrix(body);
  matrix.set_zero();
  return matrix;
}

/// -d force / d x by central differences.
template <int Dim, typename Force>
Eigen::MatrixXd negative_slope(const Force& force, PointsOf<Dim> x, double step) {
  Eigen::MatrixXd slope(x.size(), x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const double here = x.reshaped()[k];
    x.reshaped()[k] = here + step;
    const PointsOf<Dim> ahead = force(x);
    x.reshaped()[k] = here - step;
    slope.col(k) = (force(x) - ahead).reshaped() / (2 * step);
    x.reshaped()[k] = here;
  }
  return slope;
}

template <typename Dimension>
class SystemMatrices : public testing::Test {};
TYPED_TEST_SUITE(SystemMatrices, BothDimensions, DimensionName);

TYPED_TEST(SystemMatrices, StiffnessIsTheHessianAtRest) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(6u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const BodyOf<Dim> body = random_body<Dim>(seed);
    const Eigen::VectorXd ones = passive(body);
    SystemMatrixOf<Dim> matrix = zero_matrix(body);
    matrix.add_stiffness(body, body.rest, ones, 1);
    const auto force = [&](const PointsOf<Dim>& x) {
      PointsOf<Dim> sum = PointsOf<Dim>::Zero(Dim, x.cols());
      add_elastic_forces(body, x, ones, sum);
      return sum;
    };
    const Eigen::MatrixXd expected = negative_slope<Dim>(force, body.rest, 1e-6);
    EXPECT_LT((dense(matrix) - expected).norm(), 1e-7 * expected.norm());
  }
}

TYPED_TEST(SystemMatrices, DampingIsTheSlopeOfTheDashpots) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(6u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const BodyOf<Dim> body = random_body<Dim>(seed);
    const PointsOf<Dim> x = body.rest + random_points<Dim>(random, body.node_count(), 0.03);
    SystemMatrixOf<Dim> matrix = zero_matrix(body);
    matrix.add_damping(body, x, 1);
    const auto force = [&](const PointsOf<Dim>& v) {
      PointsOf<Dim> sum = PointsOf<Dim>::Zero(Dim, v.cols());
      add_damping_forces(body, x, v, sum);
      return sum;
    };
    const Eigen::MatrixXd expected = negative_slope<Dim>(force, random_points<Dim>(random, body.node_count(), 1), 1e-3);
    EXPECT_LT((dense(matrix) - expected).norm(), 1e-9 * expected.norm());
  }
}

TYPED_TEST(SystemMatrices, IsPositiveSemiDefiniteInAnyState) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(20u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const BodyOf<Dim> body = random_body<Dim>(seed);
    const PointsOf<Dim> x = body.rest + random_points<Dim>(random, body.node_count(), 0.1);  // inverted tets among them
    SystemMatrixOf<Dim> matrix = zero_matrix(body);
    matrix.add_stiffness(body, x, random_activation(random, body, 0.4), 1);
    const Eigen::VectorXd eigenvalues =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(matrix), Eigen::EigenvaluesOnly).eigenvalues();
    EXPECT_GT(eigenvalues.minCoeff(), -1e-12 * eigenvalues.maxCoeff());
  }
}

TYPED_TEST(SystemMatrices, ContactIsASpringAtTheEmbeddedPoint) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(20u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const BodyOf<Dim> body = random_body<Dim>(seed);
    ContactPointsOf<Dim> points;
    points.nodes = body.tets.col(static_cast<Eigen::Index>(seed) % body.tet_count());
    points.weights = Eigen::Vector4d(0.1, 0.2, 0.3, 0.4).tail<Dim + 1>() / (Dim == 3 ? 1 : 0.9);
    const BlockOf<Dim> half = random_points<Dim>(random, Dim, 1), block = half * half.transpose();
    SystemMatrixOf<Dim> matrix = zero_matrix(body);
    matrix.add_contact(points, 0, block);
    Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(Dim, Dim * body.node_count());
    for (int k = 0; k <= Dim; ++k)
      weights.template middleCols<Dim>(Dim * points.nodes(k, 0)) = points.weights(k, 0) * BlockOf<Dim>::Identity();
    const Eigen::MatrixXd expected = weights.transpose() * block * weights;
    EXPECT_LT((dense(matrix) - expected).norm(), 1e-14);
  }
}

TYPED_TEST(SystemMatrices, SolvesForSeveralColumnsAtOnce) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(20u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const BodyOf<Dim> body = seed == 0 ? four_legged<Dim>() : random_body<Dim>(seed);
    const double dt = 1.0 / 240;
    SystemMatrixOf<Dim> matrix = zero_matrix(body);
    matrix.add_mass(body, 1 / (dt * dt));
    matrix.add_stiffness(body, body.rest + random_points<Dim>(random, body.node_count(), 0.02),
                         random_activation(random, body, 0.3), 1);
    matrix.add_damping(body, body.rest, 1 / dt);
    ASSERT_TRUE(matrix.factor());
    const Eigen::MatrixXd wanted = random_points<Dim>(random, body.node_count() * 5, 1).reshaped(Dim * body.node_count(), 5);
    Eigen::MatrixXd columns = matrix.lower().template selfadjointView<Eigen::Lower>() * wanted;
    matrix.solve_in_place(columns);
    EXPECT_LT((columns - wanted).norm(), 1e-11 * wanted.norm());
    Eigen::VectorXd one = matrix.lower().template selfadjointView<Eigen::Lower>() * wanted.col(2);
    matrix.solve_in_place(one);
    EXPECT_LT((one - wanted.col(2)).norm(), 1e-11 * wanted.norm());
  }
}

TYPED_TEST(SystemMatrices, RefusesToFactorWhatIsNotPositiveDefiniteAndRecovers) {
  constexpr int Dim = TypeParam::kDim;
  const BodyOf<Dim> body = random_body<Dim>(2);
  SystemMatrixOf<Dim> matrix = zero_matrix(body);
  matrix.add_mass(body, -1);
  EXPECT_FALSE(matrix.factor());
  matrix.set_zero();
  matrix.add_mass(body, 1);
  ASSERT_TRUE(matrix.factor());
  Eigen::VectorXd column = Eigen::VectorXd::Ones(matrix.size());
  matrix.solve_in_place(column);
  EXPECT_LT((column.reshaped(Dim, body.node_count()).row(0).transpose() - body.mass.cwiseInverse()).norm(), 1e-12);
}

}  // namespace
}  // namespace hydrostat::physics::system_matrix_test

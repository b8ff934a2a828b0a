#include "physics/element_stiffness.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "physics/element_hourglass.h"
#include "tests/physics/element_scene.h"

namespace hydrostat::physics::element_stiffness_test {
namespace {

constexpr unsigned kSeeds = trials(12);

template <class Dimension>
class Stiffness : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Stiffness, Dimensions);

/// Stiffness of the whole body [N/m].
template <int Dim>
Eigen::MatrixXd assembled(const ElementBlock<Dim>& block, const NodeMatrix<Dim>& x, Definiteness definiteness) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(x.size(), x.size());
  for (int e = 0; e < block.element_count(); ++e) {
    const ElementMatrix matrix = element_stiffness<Dim>(block, e, x, nullptr, definiteness);
    for (int a = 0; a < block.nodes_per_element(); ++a) {
      for (int b = 0; b < block.nodes_per_element(); ++b) {
        sum.block<Dim, Dim>(Dim * block.nodes(a, e), Dim * block.nodes(b, e)) += matrix.block<Dim, Dim>(Dim * a, Dim * b);
      }
    }
  }
  return sum;
}

Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

TYPED_TEST(Stiffness, IsMinusTheGradientOfForce) {
  constexpr int kDim = TypeParam::value;
  constexpr double kStep = 1e-6;  // [m]
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    NodeMatrix<kDim> x = random_turn<kDim>(random) * (mesh.rest + random_nodes<kDim>(random, mesh.rest.cols(), 0.02));
    const Eigen::MatrixXd stiffness = assembled(block, x, Definiteness::kExact);
    EXPECT_LT((stiffness - stiffness.transpose()).norm(), 1e-12 * stiffness.norm());
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double here = x.reshaped()[k];
      x.reshaped()[k] = here + kStep;
      const NodeMatrix<kDim> ahead = forces_of(block, x);
      x.reshaped()[k] = here - kStep;
      const NodeMatrix<kDim> slope = (ahead - forces_of(block, x)) / (2 * kStep);
      x.reshaped()[k] = here;
      EXPECT_LT((stiffness.col(k) + slope.reshaped()).norm(), 1e-7 * stiffness.norm());
    }
  });
}

TYPED_TEST(Stiffness, ProjectedIsNeverNegativeAndExactAtRest) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    for (const double amplitude : {0.0, 0.02, 0.5}) {  // at rest, bent, inverted here and there
      const NodeMatrix<kDim> x = mesh.rest + random_nodes<kDim>(random, mesh.rest.cols(), amplitude);
      for (int e = 0; e < block.element_count(); ++e) {
        const ElementMatrix projected = element_stiffness<kDim>(block, e, x, nullptr, Definiteness::kProjected);
        const Eigen::VectorXd values = eigenvalues(projected);
        EXPECT_GT(values.minCoeff(), -1e-12 * values.maxCoeff());
        if (amplitude > 0) continue;
        const ElementMatrix exact = element_stiffness<kDim>(block, e, x, nullptr, Definiteness::kExact);
        EXPECT_LT((exact - projected).norm(), 1e-11 * exact.norm());
      }
    }
  });
}

TYPED_TEST(Stiffness, AtRestOnlyRigidMotionsAreFree) {
  constexpr int kDim = TypeParam::value, kRigid = kDim * (kDim + 1) / 2;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937&) {
    for (int e = 0; e < block.element_count(); ++e) {
      const Eigen::VectorXd values =
          eigenvalues(element_stiffness<kDim>(block, e, mesh.rest, nullptr, Definiteness::kExact));
      EXPECT_LT(std::abs(values[kRigid - 1]), 1e-12 * values.maxCoeff());
      EXPECT_GT(values[kRigid], 1e-4 * values.maxCoeff());
    }
  });
}

TYPED_TEST(Stiffness, OfABoxAtRestIsTheEnhancedStrainElement) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937&) {
    if (!block.is_box()) return;
    for (int e = 0; e < block.element_count(); ++e) {
      const ElementMaterial& material = mesh.materials[static_cast<std::size_t>(e)];
      const Eigen::MatrixXd expected =
          mesh.fill[e] * enhanced_stiffness<kDim>(corners_of<kDim>(mesh, e), lame_of(material.youngs_modulus, material.poissons_ratio));
      const ElementMatrix matrix = element_stiffness<kDim>(block, e, mesh.rest, nullptr, Definiteness::kExact);
      EXPECT_LT((matrix - expected).norm(), 1e-10 * expected.norm());
    }
  });
}

TYPED_TEST(Stiffness, HighestFrequencyBoundsThatOfTheBodyClosely) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937&) {
    Eigen::VectorXd mass = Eigen::VectorXd::Zero(mesh.rest.cols());
    add_lumped_mass(block, mass);
    Eigen::MatrixXd matrix = assembled(block, mesh.rest, Definiteness::kExact);
    const Eigen::VectorXd scale = mass.replicate(1, kDim).transpose().reshaped().cwiseSqrt().cwiseInverse();
    matrix = scale.asDiagonal() * matrix * scale.asDiagonal();
    const double greatest = std::sqrt(eigenvalues(matrix).maxCoeff());
    const double bound = highest_frequency<kDim>(block, mesh.rest, nullptr);
    EXPECT_GT(bound, greatest * (1 - 1e-12));
    EXPECT_LT(bound, greatest * 2.5);
  });
}

TYPED_TEST(Stiffness, LeastJacobiansAreOfTheMostSqueezedCorner) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const Gradient<kDim> F = random_turn<kDim>(random) + Gradient<kDim>(random_nodes<kDim>(random, kDim, 0.3));
    const Eigen::VectorXd uniform = least_jacobians<kDim>(block, mesh, F * mesh.rest);
    EXPECT_LT((uniform.array() - F.determinant()).abs().maxCoeff(), 1e-12);
    NodeMatrix<kDim> x = mesh.rest;
    const int node = block.nodes(0, 0);
    Eigen::Matrix<double, kDim, 1> others = -mesh.rest.col(node);
    for (int n = 0; n < block.nodes_per_element(); ++n) others += mesh.rest.col(block.nodes(n, 0));
    x.col(node) = 2 * others / (block.nodes_per_element() - 1) - mesh.rest.col(node);  // through the others
    EXPECT_LT(least_jacobians<kDim>(block, mesh, x)[0], 0);
  });
}

}  // namespace
}  // namespace hydrostat::physics::element_stiffness_test

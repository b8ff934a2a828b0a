#include "physics/element_activation.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <limits>

#include "physics/element_hourglass.h"
#include "tests/physics/element_scene.h"

namespace hydrostat::physics::element_activation_test {
namespace {

constexpr unsigned kSeeds = trials(15);

template <class Dimension>
class Activation : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Activation, Dimensions);

Eigen::VectorXd random_activations(std::mt19937& random, int count, double amplitude) {
  std::uniform_real_distribution<double> uniform(1 - amplitude, 1 + amplitude);
  return Eigen::VectorXd::NullaryExpr(count, [&] { return uniform(random); });
}

/// Activations whose logarithms are the constraints' stretches, linearised at rest, when the nodes move from rest by u.
template <int Dim>
Eigen::VectorXd activations_of(const ElementMesh<Dim>& mesh, const ElementConstraints& constraints, const NodeMatrix<Dim>& u) {
  Eigen::VectorXd stretch(constraints.count());
  for (int c = 0; c < constraints.count(); ++c) {
    const int low = constraints.nodes(0, c), high = constraints.nodes(1, c);
    const Eigen::Matrix<double, Dim, 1> span = mesh.rest.col(high) - mesh.rest.col(low);
    stretch[c] = std::exp(span.dot(u.col(high) - u.col(low)) / span.squaredNorm());
  }
  return stretch;
}

TYPED_TEST(Activation, OfOneChangesNothing) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const NodeMatrix<kDim> x = mesh.rest + random_nodes<kDim>(random, mesh.rest.cols(), 0.02);
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    ActiveStrain<kDim> active = make_active_strain(block);
    EXPECT_LT((forces_of(block, x, &active) - forces_of(block, x)).norm(), 1e-13 * forces_of(block, x).norm());
    ASSERT_TRUE(set_activation(make_activation_fit(mesh, constraints), Eigen::VectorXd(Eigen::VectorXd::Ones(constraints.count())), active));
    EXPECT_LT((forces_of(block, x, &active) - forces_of(block, x)).norm(), 1e-13 * forces_of(block, x).norm());
    EXPECT_NEAR(energy_of(block, x, &active) / energy_of(block, x), 1, 1e-13);
  });
}

/// A body that is bent and stretched as its activations ask, without a rotation, has no stress in any frame.
TYPED_TEST(Activation, ShapeThatFitsItIsWithoutStress) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](auto mesh, const auto& whole, std::mt19937& random) {
    // One element: its neighbours would have to turn.
    mesh.nodes = mesh.nodes.col(0).eval();
    mesh.fill = mesh.fill.head(1).eval();
    mesh.materials.resize(1);
    const ElementBlock<kDim> block = make_element_block(mesh, whole.law);
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    Gradient<kDim> strain = random_nodes<kDim>(random, kDim, 0.2);
    strain = (0.5 * (strain + strain.transpose())).eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(strain);
    const Gradient<kDim> stretch =
        modes.eigenvectors() * modes.eigenvalues().array().exp().matrix().asDiagonal() * modes.eigenvectors().transpose();
    NodeMatrix<kDim> bend = 0 * mesh.rest;
    if (block.is_box()) {
      const BoxMeasure<kDim> measure = measure_box<kDim>(corners_of<kDim>(mesh, 0));
      const NodeMatrix<kDim> patterns = random_nodes<kDim>(random, measure.kModes, 0.01) * measure.pattern.transpose();
      for (int n = 0; n < block.nodes_per_element(); ++n) bend.col(block.nodes(n, 0)) = patterns.col(n);
    }
    ActiveStrain<kDim> active = make_active_strain(block);
    const NodeMatrix<kDim> u = strain * mesh.rest + bend;
    ASSERT_TRUE(set_activation(make_activation_fit(mesh, constraints), activations_of<kDim>(mesh, constraints, u), active));
    const NodeMatrix<kDim> x = random_turn<kDim>(random) * (stretch * mesh.rest + bend);
    EXPECT_LT(forces_of(block, x, &active).norm(), 1e-9 * forces_of(block, x).norm());
    EXPECT_NEAR(energy_of(block, x, &active) / energy_of(block, x), 0, 1e-11);
  });
}

/// The fit is the nearest: what it leaves of random activations has no part that any shape could meet.
TYPED_TEST(Activation, FitLeavesOnlyWhatNoShapeMeets) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const ActivationFit<kDim> fit = make_activation_fit(mesh, make_element_constraints(mesh.nodes));
    for (int e = 0; e < block.element_count(); ++e) {
      const Eigen::MatrixXd& map = fit.maps[static_cast<std::size_t>(fit.map_of_element[e])];
      const Eigen::VectorXd asked = random_activations(random, static_cast<int>(map.cols()), 0.3);
      // Stretches of shapes span the rows of the map: a projection of them is what it started from.
      const Eigen::MatrixXd onto_shapes = map.completeOrthogonalDecomposition().pseudoInverse() * map;
      EXPECT_LT((onto_shapes - onto_shapes.transpose()).norm(), 1e-10);
      EXPECT_LT((map * (asked - onto_shapes * asked)).norm(), 1e-10 * (map * asked).norm());
      const int shapes = kDim * (kDim + 1) / 2 + (block.is_box() ? kDim * BoxMeasure<kDim>::kModes : 0);
      EXPECT_NEAR(onto_shapes.trace(), shapes, 1e-9);
    }
  });
}

TYPED_TEST(Activation, ForceIsMinusTheGradientOfEnergy) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    ActiveStrain<kDim> active = make_active_strain(block);
    ASSERT_TRUE(set_activation(make_activation_fit(mesh, constraints), random_activations(random, constraints.count(), 0.2), active));
    const NodeMatrix<kDim> x = random_turn<kDim>(random) * (mesh.rest + random_nodes<kDim>(random, mesh.rest.cols(), 0.01));
    const NodeMatrix<kDim> force = forces_of(block, x, &active);
    const NodeMatrix<kDim> slope = slope_of(x, 1e-6, [&](const NodeMatrix<kDim>& at) { return energy_of(block, at, &active); });
    EXPECT_LT((force + slope).norm(), 2e-7 * force.norm());
    const Gradient<kDim> couple = force * x.transpose();
    EXPECT_LT((couple - couple.transpose()).norm(), 1e-12 * force.norm() * x.norm());
    EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * force.norm());
  });
}

TYPED_TEST(Activation, StiffnessIsMinusTheGradientOfForce) {
  constexpr int kDim = TypeParam::value;
  constexpr double kStep = 1e-6;  // [m]
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    ActiveStrain<kDim> active = make_active_strain(block);
    ASSERT_TRUE(set_activation(make_activation_fit(mesh, constraints), random_activations(random, constraints.count(), 0.2), active));
    NodeMatrix<kDim> x = mesh.rest + random_nodes<kDim>(random, mesh.rest.cols(), 0.01);
    const int node = block.nodes(1, 0);
    Eigen::MatrixXd column = Eigen::MatrixXd::Zero(kDim, mesh.rest.cols());
    for (int e = 0; e < block.element_count(); ++e) {
      const ElementMatrix matrix = element_stiffness<kDim>(block, e, x, &active, Definiteness::kExact);
      for (int a = 0; a < block.nodes_per_element(); ++a) {
        for (int b = 0; b < block.nodes_per_element(); ++b) {
          if (block.nodes(b, e) == node) column.col(block.nodes(a, e)) += matrix.block(kDim * a, kDim * b, kDim, 1);
        }
      }
    }
    x(0, node) += kStep;
    const NodeMatrix<kDim> ahead = forces_of(block, x, &active);
    x(0, node) -= 2 * kStep;
    const NodeMatrix<kDim> slope = (ahead - forces_of(block, x, &active)) / (2 * kStep);
    EXPECT_LT((column + slope).norm(), 1e-6 * column.norm());
  });
}

TYPED_TEST(Activation, ForcePerActivationIsTheSlopeOfForce) {
  constexpr int kDim = TypeParam::value;
  constexpr double kStep = 1e-6;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    const ActivationFit<kDim> fit = make_activation_fit(mesh, constraints);
    ActiveStrain<kDim> active = make_active_strain(block);
    Eigen::VectorXd activation = random_activations(random, constraints.count(), 0.2);
    const NodeMatrix<kDim> x = random_turn<kDim>(random) * (mesh.rest + random_nodes<kDim>(random, mesh.rest.cols(), 0.01));
    const auto forces_at = [&] {
      EXPECT_TRUE(set_activation(fit, activation, active));
      return forces_of(block, x, &active);
    };
    forces_at();
    std::vector<NodeMatrix<kDim>> slope(static_cast<std::size_t>(constraints.count()), NodeMatrix<kDim>::Zero(kDim, x.cols()));
    double size = 0;
    for (int e = 0; e < block.element_count(); ++e) {
      const Eigen::MatrixXd matrix = element_force_per_activation<kDim>(block, fit, e, x, activation);
      size = std::max(size, matrix.norm());
      for (int p = 0; p < matrix.cols(); ++p) {
        for (int n = 0; n < block.nodes_per_element(); ++n) {
          slope[static_cast<std::size_t>(fit.of_element(p, e))].col(block.nodes(n, e)) += matrix.block(kDim * n, p, kDim, 1);
        }
      }
    }
    for (int c = 0; c < constraints.count(); ++c) {
      const double here = activation[c];
      activation[c] = here + kStep;
      const NodeMatrix<kDim> ahead = forces_at();
      activation[c] = here - kStep;
      const NodeMatrix<kDim> difference = (ahead - forces_at()) / (2 * kStep);
      activation[c] = here;
      EXPECT_LT((slope[static_cast<std::size_t>(c)] - difference).norm(), 1e-7 * size);
    }
  });
}

TYPED_TEST(Activation, OfTheSameEverywhereScalesTheBody) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    ActiveStrain<kDim> active = make_active_strain(block);
    for (const double scale : {0.01, 0.6, 0.99, 1.4, 10.0}) {
      const Eigen::VectorXd activation = Eigen::VectorXd::Constant(constraints.count(), scale);
      ASSERT_TRUE(set_activation(make_activation_fit(mesh, constraints), activation, active));
      const NodeMatrix<kDim> x = scale * random_turn<kDim>(random) * mesh.rest;
      EXPECT_LT(forces_of(block, x, &active).norm(), 1e-10 * forces_of(block, mesh.rest, &active).norm());
    }
  });
}

TYPED_TEST(Activation, AtItsLimitsLeavesEveryElementAShape) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    const ActivationFit<kDim> fit = make_activation_fit(mesh, constraints);
    ActiveStrain<kDim> active = make_active_strain(block);
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::VectorXd activation = random_activations(random, constraints.count(), 0.4);
      for (double& each : activation) each = each > 1 ? 1.4 : 0.6;
      ASSERT_TRUE(set_activation(fit, activation, active));
      EXPECT_TRUE(forces_of(block, mesh.rest, &active).allFinite());
      EXPECT_GE(energy_of(block, mesh.rest, &active), 0);
    }
  });
}

TYPED_TEST(Activation, ThatIsNotAboveZeroIsRefused) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(1, [](const auto& mesh, const auto& block, std::mt19937&) {
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    const ActivationFit<kDim> fit = make_activation_fit(mesh, constraints);
    ActiveStrain<kDim> active = make_active_strain(block);
    for (const double value : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
      Eigen::VectorXd activation = Eigen::VectorXd::Ones(constraints.count());
      activation[constraints.count() - 1] = value;
      EXPECT_FALSE(set_activation(fit, activation, active));
    }
  });
}

TEST(MakeActivationFit, CellsOfALatticeShareOneMap) {
  const ElementMesh<3> mesh = element_bar<3>({7, 3, 5}, {1, 0.4, 0.9}, Cut::kBoxes);
  EXPECT_EQ(make_activation_fit(mesh, make_element_constraints(mesh.nodes)).maps.size(), 1u);
}

}  // namespace
}  // namespace hydrostat::physics::element_activation_test

#include "physics/element_constraints.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/physics/element_scene.h"

namespace hydrostat::physics::element_constraints_test {
namespace {

constexpr unsigned kSeeds = trials(20);

TEST(MakeElementConstraints, AreThePairsOfEachElementOnce) {
  const auto count = [](const auto& mesh) { return make_element_constraints(mesh.nodes).count(); };
  EXPECT_EQ(count(element_bar<3>({1, 1, 1}, {1, 1, 1}, Cut::kBoxes)), 28);
  EXPECT_EQ(count(element_bar<3>({2, 1, 1}, {1, 1, 1}, Cut::kBoxes)), 28 + 22);  // a face of 6 pairs is shared
  EXPECT_EQ(count(element_bar<3>({1, 1, 1}, {1, 1, 1}, Cut::kFiveTets)), 18);
  EXPECT_EQ(count(element_bar<2>({1, 1}, {1, 1}, Cut::kBoxes)), 6);
  EXPECT_EQ(count(element_bar<2>({1, 1}, {1, 1}, Cut::kTwoTriangles)), 5);
}

template <int Dim>
void constraints_are_in_order() {
  for_random_blocks<Dim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937&) {
    const ElementConstraints constraints = make_element_constraints(mesh.nodes);
    for (int c = 0; c < constraints.count(); ++c) {
      EXPECT_LT(constraints.nodes(0, c), constraints.nodes(1, c));
      if (c == 0) continue;
      EXPECT_LT(std::make_pair(constraints.nodes(0, c - 1), constraints.nodes(1, c - 1)),
                std::make_pair(constraints.nodes(0, c), constraints.nodes(1, c)));
    }
    for (int e = 0; e < block.element_count(); ++e) {
      int pair = 0;
      for (int a = 0; a < block.nodes_per_element(); ++a) {
        for (int b = a + 1; b < block.nodes_per_element(); ++b, ++pair) {
          const Eigen::Vector2i nodes = constraints.nodes.col(constraints.of_element(pair, e));
          EXPECT_EQ(std::set({nodes[0], nodes[1]}), std::set({mesh.nodes(a, e), mesh.nodes(b, e)}));
        }
      }
    }
  });
}

TEST(MakeElementConstraints, AreInLexicographicOrderAndNamedByTheirElements) {
  constraints_are_in_order<2>();
  constraints_are_in_order<3>();
}

template <int Dim, class Check>
void for_springs(const Check& check) {
  for_random_blocks<Dim>(kSeeds, [&](const auto& mesh, const auto& block, std::mt19937& random) {
    const ConstraintSprings springs = make_constraint_springs(mesh, block, make_element_constraints(mesh.nodes), 0.7);
    const NodeMatrix<Dim> x = mesh.rest + random_nodes<Dim>(random, mesh.rest.cols(), 0.03);
    std::uniform_real_distribution<double> uniform(0.6, 1.4);
    const Eigen::VectorXd activation = Eigen::VectorXd::NullaryExpr(springs.nodes.cols(), [&] { return uniform(random); });
    check(mesh, springs, x, activation);
  });
}

template <int Dim>
NodeMatrix<Dim> spring_forces(const ConstraintSprings& springs, const NodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
  NodeMatrix<Dim> force = NodeMatrix<Dim>::Zero(Dim, x.cols());
  add_spring_forces<Dim>(springs, x, activation, force);
  return force;
}

template <int Dim>
void spring_forces_are_slopes() {
  for_springs<Dim>([](const auto&, const ConstraintSprings& springs, const NodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
    const NodeMatrix<Dim> force = spring_forces<Dim>(springs, x, activation);
    const NodeMatrix<Dim> slope =
        slope_of(x, 1e-6, [&](const NodeMatrix<Dim>& at) { return spring_energy<Dim>(springs, at, activation); });
    EXPECT_LT((force + slope).norm(), 1e-7 * force.norm());
    EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * force.norm());
  });
}

TEST(ConstraintSprings, ForceIsMinusTheGradientOfEnergy) {
  spring_forces_are_slopes<2>();
  spring_forces_are_slopes<3>();
}

template <int Dim>
void spring_forces_are_linear_in_activation() {
  for_springs<Dim>([](const auto&, const ConstraintSprings& springs, const NodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
    const Eigen::VectorXd passive = Eigen::VectorXd::Ones(activation.size());
    NodeMatrix<Dim> expected = spring_forces<Dim>(springs, x, passive);
    const NodeMatrix<Dim> per_activation = spring_force_per_activation<Dim>(springs, x);
    for (int c = 0; c < activation.size(); ++c) {
      expected.col(springs.nodes(0, c)) -= (activation[c] - 1) * per_activation.col(c);
      expected.col(springs.nodes(1, c)) += (activation[c] - 1) * per_activation.col(c);
    }
    EXPECT_LT((spring_forces<Dim>(springs, x, activation) - expected).norm(), 1e-12 * expected.norm());
  });
}

TEST(ConstraintSprings, ForceIsLinearInActivation) {
  spring_forces_are_linear_in_activation<2>();
  spring_forces_are_linear_in_activation<3>();
}

/// Swollen by a little, they hold what a solid of their Young's modulus and Poisson's ratio 1/4 does.
TEST(ConstraintSprings, ResistSwellingLikeCauchysSolid) {
  constexpr double kGrowth = 1e-4;
  const auto check = []<int Dim>(std::integral_constant<int, Dim>) {
    for_springs<Dim>([](auto mesh, const ConstraintSprings& springs, const NodeMatrix<Dim>&, const Eigen::VectorXd& activation) {
      for (ElementMaterial& material : mesh.materials) material.poissons_ratio = 0.25;
      const NodeMatrix<Dim> swollen = (1 + kGrowth) * mesh.rest;
      const double solid = energy_of(make_element_block(mesh, ElasticLaw::kCorotatedLinear), swollen);
      const Eigen::VectorXd passive = Eigen::VectorXd::Ones(activation.size());
      EXPECT_NEAR(spring_energy<Dim>(springs, swollen, passive) / solid, 0.7, 1e-6);
    });
  };
  check(std::integral_constant<int, 2>());
  check(std::integral_constant<int, 3>());
}

TEST(AddSpringForces, AreFiniteForACollapsedBody) {
  for_springs<3>([](const auto&, const ConstraintSprings& springs, const NodeMatrix<3>& x, const Eigen::VectorXd& activation) {
    const NodeMatrix<3> point = 0 * x;
    EXPECT_EQ((spring_forces<3>(springs, point, activation).norm()), 0);
    EXPECT_EQ((spring_force_per_activation<3>(springs, point).norm()), 0);
  });
}

}  // namespace
}  // namespace hydrostat::physics::element_constraints_test

#include "physics/element_forces.h"

#include <gtest/gtest.h>

#include "tests/physics/element_scene.h"

namespace hydrostat::physics::element_forces_test {
namespace {

constexpr unsigned kSeeds = trials(20);

template <class Dimension>
class Elements : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Elements, Dimensions);

/// Turned, moved and bent by a tenth of an element's width or more.
template <int Dim>
NodeMatrix<Dim> deformed(const ElementMesh<Dim>& mesh, std::mt19937& random, double amplitude = 0.015) {
  const NodeMatrix<Dim> bent = mesh.rest + random_nodes<Dim>(random, mesh.rest.cols(), amplitude);
  return (random_turn<Dim>(random) * bent).colwise() + Eigen::Matrix<double, Dim, 1>::Constant(0.3);
}

template <int Dim>
double moment(const NodeMatrix<Dim>& x, const NodeMatrix<Dim>& force) {
  const Gradient<Dim> couple = force * x.transpose();
  return (couple - couple.transpose()).norm();
}

TYPED_TEST(Elements, ForceIsMinusTheGradientOfEnergy) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const NodeMatrix<kDim> x = deformed(mesh, random), force = forces_of(block, x);
    const NodeMatrix<kDim> slope = slope_of(x, 1e-6, [&](const NodeMatrix<kDim>& at) { return energy_of(block, at); });
    EXPECT_LT((force + slope).norm(), 2e-7 * force.norm());
  });
}

TYPED_TEST(Elements, RestShapeHasNoStressAndNoEnergy) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const NodeMatrix<kDim> x = deformed(mesh, random, 0), far = deformed(mesh, random);
    EXPECT_LT(forces_of(block, x).norm(), 1e-11 * forces_of(block, far).norm());
    EXPECT_NEAR(energy_of(block, x) / energy_of(block, far), 0, 1e-13);
  });
}

TYPED_TEST(Elements, ForcesHaveNoSumAndNoMoment) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const NodeMatrix<kDim> x = deformed(mesh, random, 0.03), force = forces_of(block, x);
    EXPECT_LT(force.rowwise().sum().norm(), 1e-13 * force.norm());
    EXPECT_LT(moment<kDim>(x, force), 1e-12 * force.norm() * x.norm());
  });
}

TYPED_TEST(Elements, TurningTheBodyTurnsTheForces) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const NodeMatrix<kDim> x = deformed(mesh, random), force = forces_of(block, x);
    const Gradient<kDim> turn = random_turn<kDim>(random);
    EXPECT_LT((forces_of<kDim>(block, turn * x) - turn * force).norm(), 1e-11 * force.norm());
    EXPECT_NEAR(energy_of<kDim>(block, turn * x) / energy_of(block, x), 1, 1e-11);
  });
}

TYPED_TEST(Elements, MirroringTheBodyMirrorsTheForces) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    ElementMesh<kDim> mirrored = mesh;
    mirrored.rest.row(0) *= -1;
    for (Eigen::Index e = 0; e < mesh.nodes.cols(); ++e) {  // keeps the order of nodes that gives positive volume
      if (block.is_box()) {
        for (int c = 0; c < 1 << kDim; c += 2) std::swap(mirrored.nodes(c, e), mirrored.nodes(c + 1, e));
      } else {
        std::swap(mirrored.nodes(0, e), mirrored.nodes(1, e));
      }
    }
    ASSERT_EQ(broken_rule(mirrored), "");
    const ElementBlock<kDim> mirror_block = make_element_block(mirrored, block.law);
    NodeMatrix<kDim> x = deformed(mesh, random), force = forces_of(block, x);
    x.row(0) *= -1;
    force.row(0) *= -1;
    EXPECT_LT((forces_of(mirror_block, x) - force).norm(), 1e-10 * force.norm());
  });
}

TYPED_TEST(Elements, RangesOfBatchesAddUp) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    const NodeMatrix<kDim> x = deformed(mesh, random);
    NodeMatrix<kDim> force = NodeMatrix<kDim>::Zero(kDim, x.cols());
    double energy = 0;
    const int middle = block.batch_count() / 2;
    for (const BatchRange range : {BatchRange{0, middle}, BatchRange{middle, block.batch_count()}}) {
      add_element_forces<kDim>(block, x, nullptr, range, force);
      energy += element_energy<kDim>(block, x, nullptr, range);
    }
    EXPECT_LT((force - forces_of(block, x)).norm(), 1e-14 * force.norm());
    EXPECT_NEAR(energy / energy_of(block, x), 1, 1e-14);
  });
}

/// Under a deformation that is the same everywhere, boxes cannot be told from the simplices that fill them.
TYPED_TEST(Elements, BoxesAndSimplicesAgreeOnUniformStrain) {
  constexpr int kDim = TypeParam::value;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Gradient<kDim> F = random_turn<kDim>(random) + Gradient<kDim>(random_nodes<kDim>(random, kDim, 0.3));
    double first = 0;
    for (const Cut cut : cuts<kDim>()) {
      const ElementMesh<kDim> mesh = element_bar<kDim>(Eigen::Matrix<int, kDim, 1>::Constant(2), Eigen::Matrix<double, kDim, 1>::Ones(), cut);
      const double energy = energy_of<kDim>(make_element_block(mesh, ElasticLaw::kStableNeoHookean), F * mesh.rest);
      if (first == 0) first = energy;
      EXPECT_NEAR(energy / first, 1, 1e-12) << name_of(cut);
    }
  }
}

TYPED_TEST(Elements, FillScalesForcesAndEnergy) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](auto mesh, const auto& block, std::mt19937& random) {
    const NodeMatrix<kDim> x = deformed(mesh, random), force = forces_of(block, x);
    mesh.fill *= 0.5;
    const ElementBlock<kDim> thin = make_element_block(mesh, block.law);
    EXPECT_LT((forces_of(thin, x) - 0.5 * force).norm(), 1e-13 * force.norm());
    EXPECT_NEAR(energy_of(thin, x) / energy_of(block, x), 0.5, 1e-13);
  });
}

TYPED_TEST(Elements, AreFiniteForFlatCollapsedAndReflectedBodies) {
  constexpr int kDim = TypeParam::value;
  for_random_blocks<kDim>(kSeeds, [](const auto& mesh, const auto& block, std::mt19937& random) {
    NodeMatrix<kDim> flat = mesh.rest, reflected = mesh.rest, wild = random_nodes<kDim>(random, mesh.rest.cols(), 1);
    flat.row(1).setZero();
    reflected.row(1) *= -1;
    for (const NodeMatrix<kDim>& x : {flat, reflected, wild, NodeMatrix<kDim>(0 * flat)}) {
      EXPECT_TRUE(forces_of(block, x).allFinite());
      EXPECT_TRUE(std::isfinite(energy_of(block, x)));
      EXPECT_GE(energy_of(block, x), 0);
    }
  });
}

/// Layers of tets that all move alike in the plane feel what triangles of their thickness feel.
TEST(AddElementForces, FlatTetMeshMovesLikeItsTriangles) {
  constexpr double kThickness = 0.3;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const ElementMesh<2> triangles = element_bar<2>({3, 2}, {0.3, 0.2}, Cut::kTwoTriangles);
    const ElementMesh<3> tets = element_bar<3>({3, 2, 1}, {0.3, 0.2, kThickness}, Cut::kSixTets);
    const NodeMatrix<2> x = deformed(triangles, random);
    NodeMatrix<3> in_space = tets.rest;
    for (Eigen::Index n = 0; n < in_space.cols(); ++n) in_space.col(n).head<2>() = x.col(n % x.cols());
    const NodeMatrix<3> force_in_space = forces_of(make_element_block(tets, ElasticLaw::kStableNeoHookean), in_space);
    const NodeMatrix<2> force = forces_of(make_element_block(triangles, ElasticLaw::kStableNeoHookean), x);
    const NodeMatrix<2> of_layers = force_in_space.topLeftCorner(2, x.cols()) + force_in_space.topRightCorner(2, x.cols());
    EXPECT_LT((of_layers - kThickness * force).norm(), 1e-11 * force.norm());
  }
}

}  // namespace
}  // namespace hydrostat::physics::element_forces_test

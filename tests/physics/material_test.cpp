#include "physics/material.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <random>

#include "physics/material_rotation.h"
#include "tests/sanitizers.h"

namespace hydrostat::physics::material_test {
namespace {

constexpr unsigned kSeeds = trials(200);
constexpr ElasticLaw kLaws[] = {ElasticLaw::kStableNeoHookean, ElasticLaw::kCorotatedLinear};
constexpr double kYoungsModulus = 3;  // [Pa], so that errors are relative to about 1

template <int Dim>
Gradient<Dim> random_gradient(std::mt19937& random, double amplitude) {
  std::normal_distribution<double> normal(0, amplitude);
  return Gradient<Dim>::NullaryExpr([&] { return normal(random); });
}

template <int Dim>
Gradient<Dim> random_rotation_of(std::mt19937& random) {
  std::normal_distribution<double> normal;
  if constexpr (Dim == 3) {
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized().toRotationMatrix();
  } else {
    return Eigen::Rotation2Dd(std::atan2(normal(random), normal(random))).toRotationMatrix();
  }
}

/// From little to wildly deformed, now and then inverted; away from reflections, where a rotation jumps.
template <int Dim>
Gradient<Dim> random_deformation(std::mt19937& random, unsigned seed) {
  for (;;) {
    const Gradient<Dim> F = random_rotation_of<Dim>(random) + random_gradient<Dim>(random, 0.05 + 0.6 * (seed % 4) / 3);
    Eigen::Matrix<double, Dim, 1> stretch = signed_singular_values<Dim>(F).stretch;
    if (stretch[Dim - 2] + stretch[Dim - 1] > 0.1) return F;
  }
}

Lame random_lame(std::mt19937& random) {
  return lame_of(kYoungsModulus, std::uniform_real_distribution<double>(0, 0.49)(random));
}

template <int Dim, class Check>
void for_deformations(const Check& check) {
  for (const ElasticLaw law : kLaws) {
    for (unsigned seed = 0; seed < kSeeds; ++seed) {
      SCOPED_TRACE(name_of(law) + " " + std::to_string(Dim) + "D, seed " + std::to_string(seed));
      std::mt19937 random(seed);
      const Lame lame = random_lame(random);
      check(law, lame, random_deformation<Dim>(random, seed), random);
    }
  }
}

template <class Dimension>
class Materials : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Materials, Dimensions);

TYPED_TEST(Materials, StressIsTheGradientOfEnergy) {
  constexpr int kDim = TypeParam::value;
  constexpr double kStep = 1e-5;
  for_deformations<kDim>([](ElasticLaw law, const Lame& lame, Gradient<kDim> F, std::mt19937&) {
    const Gradient<kDim> stress = first_piola_stress<kDim>(law, lame, F);
    for (int k = 0; k < F.size(); ++k) {
      const double here = F(k);
      F(k) = here + kStep;
      const double ahead = energy_density<kDim>(law, lame, F);
      F(k) = here - kStep;
      EXPECT_NEAR(stress(k), (ahead - energy_density<kDim>(law, lame, F)) / (2 * kStep), 1e-7 * (1 + stress.norm()));
      F(k) = here;
    }
  });
}

TYPED_TEST(Materials, DerivativeIsThatOfTheStress) {
  constexpr int kDim = TypeParam::value;
  constexpr double kStep = 1e-6;
  for_deformations<kDim>([](ElasticLaw law, const Lame& lame, Gradient<kDim> F, std::mt19937&) {
    const GradientDerivative<kDim> derivative = stress_derivative<kDim>(law, lame, F, Definiteness::kExact);
    for (int k = 0; k < F.size(); ++k) {
      const double here = F(k);
      F(k) = here + kStep;
      const Gradient<kDim> ahead = first_piola_stress<kDim>(law, lame, F);
      F(k) = here - kStep;
      const Gradient<kDim> slope = (ahead - first_piola_stress<kDim>(law, lame, F)) / (2 * kStep);
      EXPECT_LT((derivative.col(k) - slope.reshaped()).norm(), 1e-7 * (1 + derivative.norm()));
      F(k) = here;
    }
  });
}

TYPED_TEST(Materials, ProjectedDerivativeIsTheExactOneWithoutItsNegativeEigenvalues) {
  constexpr int kDim = TypeParam::value;
  int indefinite = 0;
  for_deformations<kDim>([&](ElasticLaw law, const Lame& lame, const Gradient<kDim>& F, std::mt19937&) {
    const GradientDerivative<kDim> exact = stress_derivative<kDim>(law, lame, F, Definiteness::kExact);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(exact);
    const GradientDerivative<kDim> clamped =
        modes.eigenvectors() * modes.eigenvalues().cwiseMax(0).asDiagonal() * modes.eigenvectors().transpose();
    const GradientDerivative<kDim> projected = stress_derivative<kDim>(law, lame, F, Definiteness::kProjected);
    EXPECT_LT((projected - clamped).norm(), 1e-11 * exact.norm());
    indefinite += modes.eigenvalues()[0] < 0;
  });
  EXPECT_GT(indefinite, trials(40));
}

TYPED_TEST(Materials, RestHasNoEnergyAndNoStressInAnyFrame) {
  constexpr int kDim = TypeParam::value;
  for_deformations<kDim>([](ElasticLaw law, const Lame& lame, const Gradient<kDim>&, std::mt19937& random) {
    const Gradient<kDim> turn = random_rotation_of<kDim>(random);
    EXPECT_NEAR(energy_density<kDim>(law, lame, turn), 0, 1e-14 * lame.lambda + 1e-14);
    EXPECT_LT(first_piola_stress<kDim>(law, lame, turn).norm(), 1e-14 * (1 + lame.lambda));
  });
}

TYPED_TEST(Materials, TurningTheBodyOrItsGrainChangesNoEnergy) {
  constexpr int kDim = TypeParam::value;
  for_deformations<kDim>([](ElasticLaw law, const Lame& lame, const Gradient<kDim>& F, std::mt19937& random) {
    const Gradient<kDim> turn = random_rotation_of<kDim>(random);
    const double energy = energy_density<kDim>(law, lame, F);
    EXPECT_NEAR(energy_density<kDim>(law, lame, turn * F) / energy, 1, 1e-9);
    EXPECT_NEAR(energy_density<kDim>(law, lame, F * turn) / energy, 1, 1e-9);
    const Gradient<kDim> stress = first_piola_stress<kDim>(law, lame, F);
    EXPECT_LT((first_piola_stress<kDim>(law, lame, turn * F) - turn * stress).norm(), 1e-9 * (1 + stress.norm()));
  });
}

TYPED_TEST(Materials, SmallStrainsObeyHookesLaw) {
  constexpr int kDim = TypeParam::value;
  for_deformations<kDim>([](ElasticLaw law, const Lame& lame, const Gradient<kDim>&, std::mt19937& random) {
    const Gradient<kDim> H = random_gradient<kDim>(random, 1);
    const Gradient<kDim> strain = 0.5 * (H + H.transpose());
    const Gradient<kDim> hooke = lame.lambda * strain.trace() * Gradient<kDim>::Identity() + 2 * lame.mu * strain;
    const GradientDerivative<kDim> at_rest =
        stress_derivative<kDim>(law, lame, Gradient<kDim>::Identity(), Definiteness::kExact);
    EXPECT_LT((at_rest * H.reshaped() - hooke.reshaped()).norm(), 1e-12 * hooke.norm());
  });
}

TEST(StableNeoHookean, InThePlaneIsTheSpatialLawWithoutStretchAcross) {
  for_deformations<2>([](ElasticLaw law, const Lame& lame, const Gradient<2>& F, std::mt19937&) {
    if (law == ElasticLaw::kCorotatedLinear && F.determinant() < 0) return;  // inverted in the plane, in space turned over
    Gradient<3> in_space = Gradient<3>::Identity();
    in_space.topLeftCorner<2, 2>() = F;
    EXPECT_NEAR(energy_density<3>(law, lame, in_space), energy_density<2>(law, lame, F), 1e-12);
    const Gradient<2> stress = first_piola_stress<3>(law, lame, in_space).topLeftCorner<2, 2>();
    EXPECT_LT((stress - first_piola_stress<2>(law, lame, F)).norm(), 1e-12 * (1 + stress.norm()));
  });
}

TEST(StableNeoHookean, PushesABodySqueezedTowardAPointOpen) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Lame lame = random_lame(random);
    const double size = std::pow(10.0, -6.0 * seed / kSeeds) * 0.9;
    const Gradient<3> F = size * random_rotation_of<3>(random);
    EXPECT_LT((first_piola_stress<3>(ElasticLaw::kStableNeoHookean, lame, F).cwiseProduct(F)).sum(), 0);
  }
}

TEST(LameOf, GivesYoungsModulusAndPoissonsRatioBack) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    std::mt19937 random(seed);
    const double ratio = std::uniform_real_distribution<double>(0, 0.499)(random);
    const Lame lame = lame_of(kYoungsModulus, ratio);
    EXPECT_NEAR(lame.mu * (3 * lame.lambda + 2 * lame.mu) / (lame.lambda + lame.mu), kYoungsModulus, 1e-12);
    EXPECT_NEAR(lame.lambda / (2 * (lame.lambda + lame.mu)), ratio, 1e-12);
  }
}

TEST(BrokenRule, NamesTheConstantThatNoMaterialHas) {
  EXPECT_EQ(broken_rule(1e6, 0.4), "");
  EXPECT_EQ(broken_rule(1e6, 0), "");
  for (const double modulus : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(broken_rule(modulus, 0.4), "Young's modulus must be above 0 Pa");
  }
  for (const double ratio : {-0.1, 0.5, 0.7, std::nan("")}) {
    EXPECT_EQ(broken_rule(1e6, ratio), "Poisson's ratio must be at least 0 and below 0.5");
  }
}

TYPED_TEST(Materials, NearestRotationIsThatOfTheSingularValues) {
  constexpr int kDim = TypeParam::value;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const double size = std::pow(10.0, 6 - 12.0 * seed / kSeeds);  // any unit
    const Gradient<kDim> F = size * random_deformation<kDim>(random, seed);
    const SignedSingularValues<kDim> svd = signed_singular_values<kDim>(F);
    EXPECT_LT((svd.U * svd.stretch.asDiagonal() * svd.V.transpose() - F).norm(), 1e-13 * F.norm());
    EXPECT_NEAR(svd.U.determinant(), 1, 1e-13);
    EXPECT_NEAR(svd.V.determinant(), 1, 1e-13);
    const Gradient<kDim> R = nearest_rotation(F);
    EXPECT_LT((R - svd.U * svd.V.transpose()).norm(), 1e-12);
  }
}

TYPED_TEST(Materials, NearestRotationIsARotationWhereNoneIsNearest) {
  constexpr int kDim = TypeParam::value;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Eigen::Matrix<double, kDim, 1> stretch = Eigen::Matrix<double, kDim, 1>::Ones();
    stretch[kDim - 1] = -1 + (seed % 3 == 0 ? 0 : 1e-9 * seed);
    if (seed % 5 == 0) stretch = Eigen::Matrix<double, kDim, 1>::Unit(0);  // a line
    if (seed % 7 == 0) stretch.setZero();                  // a point
    const Gradient<kDim> F = random_rotation_of<kDim>(random) * stretch.asDiagonal() * random_rotation_of<kDim>(random);
    const Gradient<kDim> R = nearest_rotation(F);
    EXPECT_LT((R.transpose() * R - Gradient<kDim>::Identity()).norm(), 1e-8);
    EXPECT_GT(R.determinant(), 0);
  }
}

TEST(NearestRotation, OfFourAtOnceIsThatOfEach) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Gradient<3> each[Lanes::kCount];
    SquareMatrix<Lanes, 3> F;
    for (int lane = 0; lane < Lanes::kCount; ++lane) {
      each[lane] = random_deformation<3>(random, seed + lane);
      if (seed % 8 == 0 && lane == 2) each[lane] = Eigen::Vector3d(1, 1, -1).asDiagonal();
      for (int k = 0; k < 9; ++k) F(k).value[lane] = each[lane](k);
    }
    const SquareMatrix<Lanes, 3> R = nearest_rotation(F);
    for (int lane = 0; lane < Lanes::kCount; ++lane) {
      const Gradient<3> expected = nearest_rotation(each[lane]);
      for (int k = 0; k < 9; ++k) EXPECT_NEAR(R(k)[lane], expected(k), 1e-12);
    }
  }
}

}  // namespace
}  // namespace hydrostat::physics::material_test

#include "physics/element_hourglass.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "tests/physics/element_scene.h"

namespace hydrostat::physics::element_hourglass_test {
namespace {

constexpr unsigned kSeeds = trials(50);

template <class Dimension>
class Boxes : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Boxes, Dimensions);

/// A box of 0.1 m, bent out of shape and turned, its sides up to 1:3.
template <int Dim>
Corners<Dim> random_box(std::mt19937& random) {
  const Eigen::Matrix<double, Dim, 1> size = 0.1 * (2 * Eigen::Matrix<double, Dim, 1>::Ones() + random_nodes<Dim>(random, 1, 1));
  const NodeMatrix<Dim> corners = element_bar<Dim>(Eigen::Matrix<int, Dim, 1>::Ones(), size, Cut::kBoxes).rest;
  return random_turn<Dim>(random) * (corners + random_nodes<Dim>(random, corners.cols(), 0.02));
}

template <int Dim, class Check>
void for_random_boxes(const Check& check) {
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Corners<Dim> corners = random_box<Dim>(random);
    const Lame lame = lame_of(1, std::uniform_real_distribution<double>(0, 0.499)(random));
    check(corners, lame, random);
  }
}

template <int Dim>
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

TYPED_TEST(Boxes, OnlyRigidMotionsAreFree) {
  constexpr int kDim = TypeParam::value, kRigid = kDim * (kDim + 1) / 2;
  for_random_boxes<kDim>([](const Corners<kDim>& corners, const Lame& lame, std::mt19937&) {
    for (const bool volume_modes : {false, true}) {
      const Eigen::VectorXd values = eigenvalues<kDim>(enhanced_stiffness<kDim>(corners, lame, volume_modes));
      const double shear_scale = lame.mu * std::pow(0.1, kDim - 2);
      EXPECT_LT(values[kRigid - 1], 1e-10 * shear_scale);
      EXPECT_GT(values[0], -1e-10 * shear_scale - 1e-13 * values.maxCoeff());
      EXPECT_GT(values[kRigid], 0.02 * shear_scale);
    }
  });
}

TYPED_TEST(Boxes, PassThePatchTest) {
  constexpr int kDim = TypeParam::value;
  for_random_boxes<kDim>([](const Corners<kDim>& corners, const Lame& lame, std::mt19937& random) {
    const BoxMeasure<kDim> measure = measure_box<kDim>(corners);
    const Gradient<kDim> H = random_nodes<kDim>(random, kDim, 1);
    const Gradient<kDim> stress = lame.lambda * H.trace() * Gradient<kDim>::Identity() + lame.mu * (H + H.transpose());
    const Corners<kDim> displacement = H * corners, expected = measure.volume * stress * measure.gradient.transpose();
    const Eigen::VectorXd force = enhanced_stiffness<kDim>(corners, lame) * displacement.reshaped();
    EXPECT_LT((force - expected.reshaped()).norm(), 1e-11 * expected.norm());
  });
}

TYPED_TEST(Boxes, MeanStrainAndHourglassesAreTheWholeElement) {
  constexpr int kDim = TypeParam::value;
  using Measure = BoxMeasure<kDim>;
  for_random_boxes<kDim>([](const Corners<kDim>& corners, const Lame& lame, std::mt19937& random) {
    const Measure measure = measure_box<kDim>(corners);
    const Corners<kDim> displacement = random_nodes<kDim>(random, Measure::kNodes, 1);
    const Gradient<kDim> H = displacement * measure.gradient;
    const Gradient<kDim> stress = lame.lambda * H.trace() * Gradient<kDim>::Identity() + lame.mu * (H + H.transpose());
    const Eigen::Matrix<double, kDim, Measure::kModes> h = displacement * measure.hourglass;
    const Eigen::VectorXd s = hourglass_stiffness<kDim>(corners, measure, lame) * h.reshaped();
    const Corners<kDim> sum = measure.volume * stress * measure.gradient.transpose() +
                              s.reshaped(kDim, Measure::kModes) * measure.hourglass.transpose();
    const Eigen::VectorXd force = enhanced_stiffness<kDim>(corners, lame) * displacement.reshaped();
    EXPECT_LT((sum.reshaped() - force).norm(), 1e-10 * force.norm());
  });
}

TYPED_TEST(Boxes, MeasureLinearMotionsAndPatternsApart) {
  constexpr int kDim = TypeParam::value;
  using Measure = BoxMeasure<kDim>;
  for_random_boxes<kDim>([](const Corners<kDim>& corners, const Lame&, std::mt19937&) {
    const Measure measure = measure_box<kDim>(corners);
    const Eigen::Matrix<double, 1, Measure::kNodes> ones = Eigen::Matrix<double, 1, Measure::kNodes>::Ones();
    EXPECT_LT((corners * measure.gradient - Gradient<kDim>::Identity()).norm(), 1e-12);
    EXPECT_LT((ones * measure.gradient).norm(), 1e-11);
    EXPECT_LT((corners * measure.hourglass).norm(), 1e-14);
    EXPECT_LT((ones * measure.hourglass).norm(), 1e-13);
    EXPECT_LT((measure.pattern.transpose() * measure.gradient).norm(), 1e-10);
    EXPECT_TRUE((measure.pattern.transpose() * measure.hourglass).isIdentity(1e-11));
    EXPECT_NEAR(measure.nodal_volume.sum() / measure.volume, 1, 1e-13);
    EXPECT_GT(measure.nodal_volume.minCoeff(), 0);
  });
}

TYPED_TEST(Boxes, HourglassesStaySoftWhereVolumeIsNearlyKept) {
  constexpr int kDim = TypeParam::value;
  for_random_boxes<kDim>([](const Corners<kDim>&, const Lame&, std::mt19937& random) {
    const Eigen::Matrix<double, kDim, 1> size =
        0.1 * (2 * Eigen::Matrix<double, kDim, 1>::Ones() + random_nodes<kDim>(random, 1, 1));
    const Corners<kDim> corners = element_bar<kDim>(Eigen::Matrix<int, kDim, 1>::Ones(), size, Cut::kBoxes).rest;
    const BoxMeasure<kDim> measure = measure_box<kDim>(corners);
    const auto stiffest = [&](double poissons_ratio) {
      return eigenvalues<kDim>(hourglass_stiffness<kDim>(corners, measure, lame_of(1, poissons_ratio))).maxCoeff();
    };
    EXPECT_NEAR(stiffest(0.499999) / stiffest(0.49), 1, 0.05);
  });
}

TYPED_TEST(Boxes, FoldedOnesAreSeen) {
  constexpr int kDim = TypeParam::value;
  Corners<kDim> corners = element_bar<kDim>(Eigen::Matrix<int, kDim, 1>::Ones(), Eigen::Matrix<double, kDim, 1>::Ones(), Cut::kBoxes).rest;
  EXPECT_NEAR(measure_box<kDim>(corners).least_jacobian_ratio, 1, 1e-14);
  corners.col(0).setConstant(kDim == 2 ? 0.6 : 0.7);  // beyond the diagonal of its neighbours
  EXPECT_LT(measure_box<kDim>(corners).least_jacobian_ratio, 0);
}

}  // namespace
}  // namespace hydrostat::physics::element_hourglass_test

#include "retarget/vibration.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hydrostat::retarget::vibration_test {
namespace {

/// Masses in a row between two walls, joined by springs.
Eigen::SparseMatrix<double> chain(Eigen::Index count, double stiffness) {
  Eigen::SparseMatrix<double> matrix(count, count);
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < count; ++i) {
    entries.emplace_back(i, i, 2 * stiffness);
    if (i + 1 == count) continue;
    entries.emplace_back(i, i + 1, -stiffness);
    entries.emplace_back(i + 1, i, -stiffness);
  }
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

TEST(LowestModes, OfAChainAreThoseOfTheBook) {
  for (const Eigen::Index count : {1, 7, 150}) {
    const Vibration modes = lowest_modes(chain(count, 30), Eigen::VectorXd::Constant(count, 0.5), 6);
    ASSERT_EQ(modes.squared_frequency.size(), std::min<Eigen::Index>(count, 6));
    for (Eigen::Index k = 0; k < modes.squared_frequency.size(); ++k) {
      const double expected = 2 * 30 / 0.5 * (1 - std::cos(M_PI * static_cast<double>(k + 1) / static_cast<double>(count + 1)));
      EXPECT_NEAR(modes.squared_frequency[k], expected, 1e-5 * expected) << count << " masses, mode " << k;
    }
  }
}

TEST(LowestModes, StandAcrossEachOtherInTermsOfMass) {
  const Eigen::Index count = 90;
  const Eigen::VectorXd mass = Eigen::VectorXd::LinSpaced(count, 0.2, 3);
  const Eigen::SparseMatrix<double> stiffness = chain(count, 12);
  const Vibration modes = lowest_modes(stiffness, mass, 10);
  const Eigen::MatrixXd shared = modes.shapes.transpose() * mass.asDiagonal() * modes.shapes;
  EXPECT_LT((shared - Eigen::MatrixXd::Identity(10, 10)).cwiseAbs().maxCoeff(), 1e-9);
  const Eigen::MatrixXd force = stiffness * modes.shapes, inertia = mass.asDiagonal() * modes.shapes * modes.squared_frequency.asDiagonal();
  EXPECT_LT((force - inertia).norm(), 1e-2 * force.norm());
  EXPECT_EQ(lowest_modes(stiffness, mass, 10).shapes, modes.shapes) << "the same bits again";
}

TEST(LowestModes, AreNoneOfABodyThatNothingHolds) {
  Eigen::SparseMatrix<double> free = chain(5, 1);
  free.coeffRef(0, 0) = free.coeffRef(4, 4) = 1;
  free.coeffRef(2, 2) = 1.5;  // gives way
  EXPECT_EQ(lowest_modes(free, Eigen::VectorXd::Ones(5), 3).squared_frequency.size(), 0);
  EXPECT_EQ(lowest_modes(Eigen::SparseMatrix<double>(0, 0), Eigen::VectorXd(), 3).squared_frequency.size(), 0);
}

}  // namespace
}  // namespace hydrostat::retarget::vibration_test

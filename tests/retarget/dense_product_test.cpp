#include "retarget/dense_product.h"

#include <gtest/gtest.h>

#include <random>

namespace hydrostat::retarget {
namespace {

/// Sum by sum, as the definition has it.
Eigen::MatrixXd by_definition(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      for (Eigen::Index k = 0; k < a.cols(); ++k) result(i, j) += a(i, k) * b(k, j);
    }
  }
  return result;
}

TEST(DenseProduct, IsTheDefinitionsOfAnySizeAndOfParts) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::srand(seed);
    const auto size = [&random] { return static_cast<Eigen::Index>(random() % 70); };  // 0 as well
    const Eigen::Index m = size(), k = size(), n = size();
    const Eigen::MatrixXd a = Eigen::MatrixXd::Random(m + 3, k), b = Eigen::MatrixXd::Random(k + 1, n);
    const auto part = a.middleRows(2, m);
    const auto other = b.topRows(k);
    const Eigen::MatrixXd expected = by_definition(part, other);
    const double rounding = 1e-15 * static_cast<double>(k + 1);
    const Eigen::MatrixXd straight = product(part, other), turned = product_of_transposed(Eigen::MatrixXd(part.transpose()), other);
    ASSERT_EQ(straight.rows(), m);
    ASSERT_EQ(straight.cols(), n);
    ASSERT_EQ(turned.rows(), m);
    ASSERT_EQ(turned.cols(), n);
    EXPECT_TRUE(((straight - expected).array().abs() <= rounding).all()) << m << " " << k << " " << n;
    EXPECT_TRUE(((turned - expected).array().abs() <= rounding).all()) << m << " " << k << " " << n;
    EXPECT_EQ(straight, product(part, other));
  }
}

TEST(DenseProduct, PassesOnWhatIsNoNumber) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Ones(5, 5);
  a(2, 3) = std::nan("");
  const Eigen::MatrixXd result = product(a, Eigen::MatrixXd::Ones(5, 5));
  EXPECT_TRUE(result.row(2).array().isNaN().all());
  EXPECT_FALSE(result.row(1).array().isNaN().any());
}

}  // namespace
}  // namespace hydrostat::retarget

#include "retarget/dense_product.h"

#include "physics/wide.h"
#include "retarget/dense_product_wide.h"

namespace hydrostat::retarget {
namespace {

#ifdef HYDROSTAT_WIDE
ColumnsOfFactor columns_of(const DenseFactor& factor) { return {factor.data(), factor.rows(), factor.cols(), factor.outerStride()}; }
#endif

Eigen::MatrixXd multiply(const DenseFactor& a, bool is_transposed, const DenseFactor& b) {
#ifdef HYDROSTAT_WIDE
  static const bool is_wide = physics::processor_is_wide();
  if (is_wide) {
    Eigen::MatrixXd result(is_transposed ? a.cols() : a.rows(), b.cols());
    multiply_wide(columns_of(a), is_transposed, columns_of(b), result.data());
    return result;
  }
#endif
  return is_transposed ? Eigen::MatrixXd(a.transpose() * b) : Eigen::MatrixXd(a * b);
}

}  // namespace

Eigen::MatrixXd product(const DenseFactor& a, const DenseFactor& b) { return multiply(a, false, b); }
Eigen::MatrixXd product_of_transposed(const DenseFactor& a, const DenseFactor& b) { return multiply(a, true, b); }

}  // namespace hydrostat::retarget

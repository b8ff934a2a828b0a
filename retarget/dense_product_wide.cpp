// Compiled for AVX2 and fused multiply-add as a whole, under another name for Eigen's namespace: functions of the same name elsewhere
// are compiled for every processor, and the linker keeps one of each.
#include "retarget/dense_product_wide.h"

#include "physics/wide.h"

#ifdef HYDROSTAT_WIDE
#define Eigen EigenWide
#include <Eigen/Core>

namespace hydrostat::retarget {
namespace {

EigenWide::Map<const EigenWide::MatrixXd, 0, EigenWide::OuterStride<>> matrix_of(const ColumnsOfFactor& factor) {
  return {factor.data, factor.rows, factor.columns, EigenWide::OuterStride<>(factor.stride)};
}

}  // namespace

void multiply_wide(const ColumnsOfFactor& a, bool is_transposed, const ColumnsOfFactor& b, double* result) {
  EigenWide::Map<EigenWide::MatrixXd> to(result, is_transposed ? a.columns : a.rows, b.columns);
  if (is_transposed) {
    to.noalias() = matrix_of(a).transpose() * matrix_of(b);
  } else {
    to.noalias() = matrix_of(a) * matrix_of(b);
  }
}

}  // namespace hydrostat::retarget
#endif

#pragma once

#include <cstddef>

namespace hydrostat::retarget {

/// A matrix in columns, `stride` numbers apart.
struct ColumnsOfFactor {
  const double* data;
  std::ptrdiff_t rows, columns, stride;
};

/// a b or, of a transposed, a' b, into `result`, whose columns follow each other. For processors with AVX2 and fused multiply-add alone.
void multiply_wide(const ColumnsOfFactor& a, bool is_transposed, const ColumnsOfFactor& b, double* result);

}  // namespace hydrostat::retarget

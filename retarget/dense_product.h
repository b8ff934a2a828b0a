#pragma once

#include <Eigen/Core>

namespace hydrostat::retarget {

using DenseFactor = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// a b of large matrices, m x k by k x n, and a' b, k x m by k x n: by AVX2 where the processor has it. Results depend on the processor,
/// never on the threads.
Eigen::MatrixXd product(const DenseFactor& a, const DenseFactor& b);
Eigen::MatrixXd product_of_transposed(const DenseFactor& a, const DenseFactor& b);

}  // namespace hydrostat::retarget

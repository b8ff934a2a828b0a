#include "retarget/smooth.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {

Motion smooth(const Motion& motion, double cutoff_hz) {
  const int pad = static_cast<int>(std::ceil(3 * motion.rate_hz / cutoff_hz)) + 6;
  const Eigen::MatrixXd padded = padded_frames(motion, pad);
  const int n = static_cast<int>(padded.cols());
  const double penalty = std::pow(2 * std::sin(M_PI * std::min(0.49, cutoff_hz / motion.rate_hz)), -6);
  Eigen::SparseMatrix<double> difference(n - 3, n);
  std::vector<Eigen::Triplet<double>> entries;
  for (int r = 0; r < n - 3; ++r) {
    const double stencil[4] = {-1, 3, -3, 1};
    for (int k = 0; k < 4; ++k) entries.emplace_back(r, r + k, stencil[k]);
  }
  difference.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseMatrix<double> matrix = penalty * Eigen::SparseMatrix<double>(difference.transpose() * difference);
  for (int i = 0; i < n; ++i) matrix.coeffRef(i, i) += 1;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  const Eigen::MatrixXd smoothed = factor.solve(padded.transpose());
  Motion result = motion;
  result.frames = smoothed.transpose().middleCols(pad, motion.count());
  return result;
}

}  // namespace hydrostat::retarget

#include "io/principal_directions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace hydrostat::io {

Eigen::MatrixXd principal_directions(const Eigen::MatrixXd& samples, double enough, Eigen::Index most) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(samples.transpose() * samples);  // small: one row a sample
  most = std::min(most, samples.cols());
  double left = std::max(0.0, solver.eigenvalues().sum());
  Eigen::Index kept = 0;
  while (kept < most && left > enough) left -= solver.eigenvalues()[samples.cols() - 1 - kept++];
  Eigen::MatrixXd directions(samples.rows(), kept);
  for (Eigen::Index k = 0; k < kept; ++k)
    directions.col(k) = (samples * solver.eigenvectors().col(samples.cols() - 1 - k)).normalized();
  return directions;
}

}  // namespace hydrostat::io

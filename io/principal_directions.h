#pragma once

#include <Eigen/Core>

namespace hydrostat::io {

/// Orthonormal columns that hold most of the columns of `samples` (R x S), at most `most`: as many as it takes until the
/// squared norm of what they leave, summed over the samples, is `enough`.
Eigen::MatrixXd principal_directions(const Eigen::MatrixXd& samples, double enough, Eigen::Index most);

}  // namespace hydrostat::io

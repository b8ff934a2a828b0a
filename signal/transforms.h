#pragma once

#include <Eigen/Core>

namespace hydrostat::signal {

/// Discrete Fourier transform of every column of samples (n x C), unscaled: row k <= n/2 holds the sum of x_j cos(2 pi j k /
/// n), row n - k for 0 < k < n/2 the sum of -x_j sin(2 pi j k / n). Returns n x C. Safe from several threads at once.
Eigen::MatrixXd real_fourier_transform(const Eigen::Ref<const Eigen::MatrixXd>& samples);

/// DCT-II of every column of samples (n x C), unscaled: row k holds twice the sum of x_j cos(pi (j + 1/2) k / n).
/// Returns n x C. Safe from several threads at once.
Eigen::MatrixXd cosine_transform(const Eigen::Ref<const Eigen::MatrixXd>& samples);

}  // namespace hydrostat::signal

#pragma once

#include <Eigen/Core>
#include <random>

namespace hydrostat::signal {

/// Frames x channels of white noise in [-1, 1].
inline Eigen::MatrixXd random_samples(unsigned seed, int frames, int channels) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> value(-1, 1);
  return Eigen::MatrixXd::NullaryExpr(frames, channels, [&] { return value(generator); });
}

/// A loop whose harmonics 0 to 5 fall off like 1 / (1 + k^2), about 1, as activations do.
inline Eigen::MatrixXd smooth_loop(unsigned seed, int frames, int channels) {
  const Eigen::MatrixXd cosine = random_samples(seed, 6, channels);
  const Eigen::MatrixXd sine = random_samples(seed + 1000, 6, channels);
  Eigen::MatrixXd samples = Eigen::MatrixXd::Ones(frames, channels);
  for (int j = 0; j < frames; ++j) {
    for (int k = 0; k < 6; ++k) {
      const double turn = 2 * 3.14159265358979323846 * k * j / frames;
      samples.row(j) += 0.1 / (1 + k * k) * (std::cos(turn) * cosine.row(k) + std::sin(turn) * sine.row(k));
    }
  }
  return samples;
}

}  // namespace hydrostat::signal

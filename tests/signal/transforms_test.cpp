#include "signal/transforms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <thread>
#include <vector>

#include "tests/signal/random_samples.h"

namespace hydrostat::signal::transforms_test {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(RealFourierTransform, IsTheSumThatDefinesIt) {
  for (const int n : {2, 3, 7, 12}) {
    SCOPED_TRACE("n " + std::to_string(n));
    const Eigen::MatrixXd samples = random_samples(static_cast<unsigned>(n), n, 3);
    const Eigen::MatrixXd transform = real_fourier_transform(samples);
    for (int k = 0; k <= n / 2; ++k) {
      Eigen::RowVectorXd cosine = Eigen::RowVectorXd::Zero(3);
      Eigen::RowVectorXd sine = Eigen::RowVectorXd::Zero(3);
      for (int j = 0; j < n; ++j) {
        cosine += samples.row(j) * std::cos(2 * kPi * j * k / n);
        sine += samples.row(j) * std::sin(2 * kPi * j * k / n);
      }
      EXPECT_LT((transform.row(k) - cosine).norm(), 1e-13);
      if (k > 0 && 2 * k < n) {
        EXPECT_LT((transform.row(n - k) + sine).norm(), 1e-13);
      }
    }
  }
}

TEST(CosineTransform, IsTheSumThatDefinesIt) {
  for (const int n : {1, 4, 9}) {
    SCOPED_TRACE("n " + std::to_string(n));
    const Eigen::MatrixXd samples = random_samples(static_cast<unsigned>(n), n, 2);
    const Eigen::MatrixXd transform = cosine_transform(samples);
    for (int k = 0; k < n; ++k) {
      Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(2);
      for (int j = 0; j < n; ++j) sum += 2 * samples.row(j) * std::cos(kPi * (j + 0.5) * k / n);
      EXPECT_LT((transform.row(k) - sum).norm(), 1e-13);
    }
  }
}

TEST(RealFourierTransform, GivesTheSameBitsFromSeveralThreads) {
  const Eigen::MatrixXd samples = random_samples(5, 46, 40);
  const Eigen::MatrixXd alone = real_fourier_transform(samples);
  std::vector<Eigen::MatrixXd> together(8);
  {
    std::vector<std::jthread> threads;
    for (Eigen::MatrixXd& result : together) threads.emplace_back([&] { result = real_fourier_transform(samples); });
  }
  for (const Eigen::MatrixXd& result : together) EXPECT_EQ(result, alone);
}

}  // namespace
}  // namespace hydrostat::signal::transforms_test

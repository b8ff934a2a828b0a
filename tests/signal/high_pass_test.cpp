#include "signal/high_pass.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hydrostat::signal::high_pass_test {
namespace {

constexpr double kCutoff = 10, kRate = 120;

/// RMS of a filtered sine of amplitude sqrt(2), once the filter has settled.
double gain(double hz) {
  HighPass filter(kCutoff, kRate, 2);
  double squares = 0;
  for (int k = 0; k < 2400; ++k) {
    const double sine = std::sqrt(2.0) * std::sin(2 * M_PI * hz * k / kRate + 0.3);
    const Eigen::VectorXd& out = filter.next(Eigen::Vector2d(sine, -3 * sine));
    EXPECT_NEAR(out[1], -3 * out[0], 1e-12);
    if (k >= 1200) squares += out[0] * out[0];
  }
  return std::sqrt(squares / 1200);
}

// A bilinear Butterworth filter's gain: 1 / sqrt(1 + (tan(w_c / 2) / tan(w / 2))^8).
TEST(HighPass, HasTheGainOfAButterworthFilterOfFourthOrder) {
  for (const double hz : {1.0, 2.0, 5.0, 8.0, 10.0, 12.0, 20.0, 40.0, 55.0}) {
    const double ratio = std::tan(M_PI * kCutoff / kRate) / std::tan(M_PI * hz / kRate);
    EXPECT_NEAR(gain(hz), 1 / std::sqrt(1 + std::pow(ratio, 8)), 1e-5) << hz;
  }
  EXPECT_NEAR(gain(kCutoff), std::sqrt(0.5), 1e-5);
}

TEST(HighPass, LetsNothingThroughThatStays) {
  HighPass filter(kCutoff, kRate, 1);
  for (int k = 0; k < 600; ++k) filter.next(Eigen::VectorXd::Constant(1, 5));
  EXPECT_NEAR(filter.next(Eigen::VectorXd::Constant(1, 5))[0], 0, 1e-9);
}

}  // namespace
}  // namespace hydrostat::signal::high_pass_test

#include "retarget/observer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hydrostat::retarget::observer_test {
namespace {

constexpr double kStep = 1.0 / 120;
constexpr int kNodes = 50;

physics::State at_step(int k) {
  return {Eigen::Matrix3Xd::Constant(3, kNodes, k), Eigen::Matrix3Xd::Constant(3, kNodes, -k)};
}

TEST(Observer, SeesTheBodyAsItWas) {
  for (const int delay : {0, 1, 2, 5}) {
    Observer observer({.delay_s = delay * kStep}, kStep);
    EXPECT_EQ(observer.delay_steps(), delay);
    for (int k = 0; k < 20; ++k) {
      const physics::State& seen = observer.see(at_step(k));
      EXPECT_EQ(seen.x(0, 0), std::max(0, k - delay));
      EXPECT_EQ(seen.v(2, kNodes - 1), -std::max(0, k - delay));
    }
  }
}

TEST(Observer, NoiseHasItsSizeIsDrawnAnewAndGivesTheSpeedThatItLooksLike) {
  constexpr double kNoise = 0.01;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Observer observer({.noise_m = kNoise, .seed = seed}, kStep), again({.noise_m = kNoise, .seed = seed}, kStep);
    double squares = 0, together = 0;
    Eigen::Matrix3Xd place;
    constexpr int kSteps = 1200;
    for (int k = 0; k < kSteps; ++k) {
      const physics::State still{Eigen::Matrix3Xd::Zero(3, kNodes), Eigen::Matrix3Xd::Zero(3, kNodes)};
      const physics::State& seen = observer.see(still);
      EXPECT_EQ(seen.x, again.see(still).x);
      squares += seen.x.squaredNorm() / static_cast<double>(seen.x.size());
      if (k > 0) {
        together += seen.x.cwiseProduct(place).sum() / static_cast<double>(seen.x.size());
        EXPECT_LT((seen.x - place - kStep * seen.v).cwiseAbs().maxCoeff(), 1e-12);
      }
      place = seen.x;
    }
    EXPECT_NEAR(std::sqrt(squares / kSteps), kNoise, 0.05 * kNoise);
    EXPECT_LT(std::abs(together), 0.02 * squares);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::observer_test

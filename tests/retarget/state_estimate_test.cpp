#include "retarget/state_estimate.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hydrostat::retarget::state_estimate_test {
namespace {

constexpr double kStep = 1.0 / 120;
constexpr double kGravity = 9.81;
constexpr int kNodes = 50;

/// A path that swings, and a body that leaves it at an even speed.
physics::State path_at(double time_s) {
  return {Eigen::Matrix3Xd::Constant(3, kNodes, 0.2 * std::sin(20 * time_s)), Eigen::Matrix3Xd::Constant(3, kNodes, 4 * std::cos(20 * time_s))};
}
physics::State body_at(double time_s) {
  physics::State state = path_at(time_s);
  state.x.array() += 0.03 * time_s;
  state.v.array() += 0.03;
  return state;
}

TEST(StateEstimate, TakesWhatIsSeenForSureAsItIs) {
  StateEstimate estimate({}, kStep, kGravity);
  for (int k = 0; k < 10; ++k) {
    const physics::State body = body_at(k * kStep), path = path_at(k * kStep);
    const physics::State& found = estimate.next(body, path, path);
    EXPECT_LT((found.x - body.x).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_LT((found.v - body.v).cwiseAbs().maxCoeff(), 1e-14);
  }
}

/// The path's own swing within the delay is known, and the deviation goes on as it went.
TEST(StateEstimate, BridgesADelayAlongThePath) {
  for (const int late : {1, 2, 6}) {
    StateEstimate estimate({.delay_s = late * kStep}, kStep, kGravity);
    for (int k = late; k < 40; ++k) {
      const double now = k * kStep, then = now - late * kStep;
      const physics::State& found = estimate.next(body_at(then), path_at(then), path_at(now));
      EXPECT_LT((found.x - body_at(now).x).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_LT((found.v - body_at(now).v).cwiseAbs().maxCoeff(), 1e-12);
    }
  }
}

TEST(StateEstimate, LeavesLittleOfTheNoiseAndFollowsWhatLeavesThePath) {
  for (const double noise : {0.001, 0.01}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE("noise " + std::to_string(noise) + ", seed " + std::to_string(seed));
      const Observation observation{.noise_m = noise, .seed = seed};
      Observer observer(observation, kStep);
      StateEstimate estimate(observation, kStep, kGravity);
      double seen_error = 0, error = 0, lag = 0;
      for (int k = 0; k < 600; ++k) {
        const physics::State body = body_at(k * kStep), path = path_at(k * kStep);
        const physics::State& seen = observer.see(body);
        const physics::State& found = estimate.next(seen, path, path);
        if (k < 300) continue;
        seen_error += (seen.x - body.x).squaredNorm();
        error += (found.x - body.x).squaredNorm();
        lag += (found.x - body.x).mean() / 300;
      }
      EXPECT_LT(std::sqrt(error / seen_error), std::sqrt(1.5 * estimate.gain()));
      EXPECT_LT(std::abs(lag), 0.05 * noise);
    }
  }
  EXPECT_GT(StateEstimate({.noise_m = 0.001}, kStep, kGravity).gain(), StateEstimate({.noise_m = 0.01}, kStep, kGravity).gain());
}

}  // namespace
}  // namespace hydrostat::retarget::state_estimate_test

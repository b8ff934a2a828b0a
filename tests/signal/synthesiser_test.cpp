#include "signal/synthesiser.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/signal/random_samples.h"

// Counts what is allocated, where no sanitizer has put its own malloc there.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
namespace {
thread_local long allocations = 0;
}
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace hydrostat::signal::synthesiser_test {
namespace {

TEST(Synthesiser, PlaysWhatTheSpectrumSays) {
  const Eigen::MatrixXd samples = random_samples(4, 40, 7);
  for (const Kind kind : {Kind::loop, Kind::one_shot}) {
    const Spectrum spectrum = analyse(kind, samples, 12);
    Synthesiser player(spectrum, /*period_s=*/0.8, -10, 10);
    Eigen::VectorXd values(7);
    for (const double time : {-0.3, 0.0, 0.123, 0.8, 5.01}) {
      EXPECT_EQ(player.at(time, values), 0);
      EXPECT_LT((values - synthesise(spectrum, time / 0.8)).cwiseAbs().maxCoeff(), 1e-13);
    }
  }
}

TEST(Synthesiser, StaysWithinItsLimitsAndCountsWhatItHolds) {
  const Spectrum spectrum = analyse_loop(random_samples(4, 40, 100), 20);
  Synthesiser free(spectrum, 1, -10, 10);
  Synthesiser held(spectrum, 1, -0.5, 0.25);
  Eigen::VectorXd before(100);
  Eigen::VectorXd after(100);
  free.at(0.31, before);
  const Eigen::Index clipped = held.at(0.31, after);
  EXPECT_EQ(clipped, (before.array() < -0.5 || before.array() > 0.25).count());
  EXPECT_GT(clipped, 0);
  EXPECT_EQ(after, before.cwiseMax(-0.5).cwiseMin(0.25));
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Synthesiser, AllocatesNothingWhilePlaying) {
  for (const Kind kind : {Kind::loop, Kind::one_shot}) {
    Synthesiser player(analyse(kind, random_samples(4, 60, 800), 16), 1, 0, 2);
    Eigen::VectorXd values(800);
    const long before = allocations;
    for (int step = 0; step < 100; ++step) player.at(0.013 * step, values);
    EXPECT_EQ(allocations, before);
  }
}

TEST(Synthesiser, TheCountOfAllocationsSeesOne) {
  const long before = allocations;
  const Eigen::VectorXd memory(1000);
  EXPECT_EQ(allocations, before + 1) << memory.size();
}
#endif

TEST(ClipToLimits, HoldsAndCounts) {
  Eigen::MatrixXd samples(2, 2);
  samples << 0.5, 0.9, 1.2, 1.0;
  EXPECT_EQ(clip_to_limits(samples, 0.8, 1.1), 2);
  EXPECT_EQ(samples, (Eigen::Matrix2d() << 0.8, 0.9, 1.1, 1.0).finished());
}

}  // namespace
}  // namespace hydrostat::signal::synthesiser_test

#pragma once

#include <algorithm>
#include <array>
#include <ctime>

namespace hydrostat::retarget {

/// The time that this thread has computed so far [s].
inline double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

constexpr int kTimings = 5;  // the median counts

inline double median(std::array<double, kTimings> values) {
  std::sort(values.begin(), values.end());
  return values[kTimings / 2];
}

/// Seconds of one call of `work`: the median of timings of many calls each.
template <typename Work>
double seconds_of(const Work& work) {
  constexpr double kPassSeconds = 0.003;  // of one timing, at least
  std::array<double, kTimings> all;
  for (double& seconds : all) {
    const double began = thread_seconds();
    long calls = 0;
    do {
      work();
      ++calls;
      seconds = thread_seconds() - began;
    } while (seconds < kPassSeconds);
    seconds /= static_cast<double>(calls);
  }
  return median(all);
}

}  // namespace hydrostat::retarget

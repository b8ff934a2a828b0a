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

/// Seconds of one call of `work`: the median of timings of many calls each. The clock is asked before and after all of a timing's
/// calls, for asking it may take longer than one of them.
template <typename Work>
double seconds_of(const Work& work) {
  constexpr double kPassSeconds = 0.003;  // of one timing, at least
  std::array<double, kTimings> all;
  long calls = 1;
  for (double& seconds : all) {
    for (;; calls *= 2) {
      const double began = thread_seconds();
      for (long k = 0; k < calls; ++k) work();
      seconds = thread_seconds() - began;
      if (seconds >= kPassSeconds) break;
    }
    seconds /= static_cast<double>(calls);
  }
  return median(all);
}

}  // namespace hydrostat::retarget

#pragma once

#include <algorithm>

namespace hydrostat {

// Sanitizers draw a test out ten to thirty times. What they look for, bad memory and undefined behaviour, shows on the
// first trials and steps; whether a law holds over all of them, and at the end of a long motion, the build without them
// tells, which runs the same tests in full. So a test asks here how far it goes, and nowhere else.

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// How many seeds or random places a law is tried on: `all`, with sanitizers a tenth of them, two at least.
template <typename Count>
constexpr Count trials(Count all) {
  return kSanitized ? std::min(all, std::max(Count{2}, all / Count{10})) : all;
}

/// How many steps a simulation takes: `all`, with sanitizers the first 24. A law of the end is then not yet to be asked:
/// `if (kSanitized) return;`
constexpr int few_steps(int all) { return kSanitized ? std::min(all, 24) : all; }

}  // namespace hydrostat

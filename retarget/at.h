#pragma once

#include <cstddef>

namespace hydrostat::retarget {

/// Entry i >= 0 of a vector or an array: their own indices have no sign, ours do, for -1 is none.
template <typename Values>
decltype(auto) at(Values& values, int i) {
  return values[static_cast<std::size_t>(i)];
}

inline constexpr int kNone = -1;

}  // namespace hydrostat::retarget

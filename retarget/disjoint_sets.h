#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace hydrostat::retarget {

/// The numbers 0 to count - 1 in sets, each on its own at first.
class DisjointSets {
 public:
  explicit DisjointSets(int count) : parent_(static_cast<std::size_t>(count)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  /// The least number of the set that holds i.
  int root(int i) {
    while (parent(i) != i) i = parent(i) = parent(parent(i));
    return i;
  }
  /// Makes the sets of a and b one; returns whether they were two. The outcome does not hang on the order of calls.
  bool join(int a, int b) {
    a = root(a);
    b = root(b);
    parent(std::max(a, b)) = std::min(a, b);
    return a != b;
  }

 private:
  int& parent(int i) { return parent_[static_cast<std::size_t>(i)]; }

  std::vector<int> parent_;
};

}  // namespace hydrostat::retarget

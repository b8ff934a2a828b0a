#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <vector>

#include "physics/dimension.h"

namespace hydrostat::physics {

/// A binary tree of boxes over things that move: its shape is made once, its boxes follow.
/// Source: van den Bergen, "Efficient collision detection of complex deformable models using AABB trees", Journal of
/// Graphics Tools 2(4), 1997.
template <int Dim>
class BoxTree {
 public:
  /// The boxes [m] Dim x things from which its shape is made.
  void grow(const PointsOf<Dim>& low, const PointsOf<Dim>& high) {
    boxes_.clear();
    order_.resize(static_cast<std::size_t>(low.cols()));
    std::iota(order_.begin(), order_.end(), 0);
    if (!order_.empty()) grow(low, high, 0, static_cast<int>(order_.size()));
    follow(low, high);
  }

  /// Takes on the things' boxes of now. Allocates nothing.
  void follow(const PointsOf<Dim>& low, const PointsOf<Dim>& high) {
    for (std::size_t b = boxes_.size(); b-- > 0;) {  // a box stands before those within it
      Box& box = boxes_[b];
      if (box.left >= 0) {
        const Box &left = boxes_[static_cast<std::size_t>(box.left)], &right = boxes_[static_cast<std::size_t>(box.right)];
        box.low = left.low.cwiseMin(right.low);
        box.high = left.high.cwiseMax(right.high);
        continue;
      }
      box.low.setConstant(std::numeric_limits<double>::infinity());
      box.high = -box.low;
      for (int n = box.begin; n < box.end; ++n) {
        box.low = box.low.cwiseMin(low.col(order_[static_cast<std::size_t>(n)]));
        box.high = box.high.cwiseMax(high.col(order_[static_cast<std::size_t>(n)]));
      }
    }
  }

  /// Calls visit(thing) for all whose leaf's box meets a box, in an order that hangs on the tree alone.
  template <typename Visit>
  void visit(const VectorOf<Dim>& low, const VectorOf<Dim>& high, const Visit& visit) const {
    if (boxes_.empty()) return;
    std::array<int, kDeepestTree> waiting;
    waiting[0] = 0;
    for (int count = 1; count > 0;) {
      const Box& box = boxes_[static_cast<std::size_t>(waiting[static_cast<std::size_t>(--count)])];
      if ((box.low.array() > high.array()).any() || (box.high.array() < low.array()).any()) continue;
      if (box.left >= 0) {
        waiting[static_cast<std::size_t>(count++)] = box.right;
        waiting[static_cast<std::size_t>(count++)] = box.left;
        continue;
      }
      for (int n = box.begin; n < box.end; ++n) visit(order_[static_cast<std::size_t>(n)]);
    }
  }

 private:
  static constexpr int kThingsOfLeaf = 2;
  static constexpr int kDeepestTree = 64;
  struct Box {
    VectorOf<Dim> low, high;
    int left = -1, right = -1;  // boxes; -1 for a leaf
    int begin = 0, end = 0;     // of order_
  };

  int grow(const PointsOf<Dim>& low, const PointsOf<Dim>& high, int begin, int end) {
    const auto at = static_cast<int>(boxes_.size());
    boxes_.push_back({VectorOf<Dim>::Zero(), VectorOf<Dim>::Zero(), -1, -1, begin, end});
    if (end - begin <= kThingsOfLeaf) return at;
    VectorOf<Dim> least = low.col(order_[static_cast<std::size_t>(begin)]),
                  most = high.col(order_[static_cast<std::size_t>(begin)]);
    for (int n = begin; n < end; ++n) {
      least = least.cwiseMin(low.col(order_[static_cast<std::size_t>(n)]));
      most = most.cwiseMax(high.col(order_[static_cast<std::size_t>(n)]));
    }
    Eigen::Index axis;
    (most - least).maxCoeff(&axis);
    const int middle = (begin + end) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
      return std::pair(low(axis, a) + high(axis, a), a) < std::pair(low(axis, b) + high(axis, b), b);
    });
    const int left = grow(low, high, begin, middle), right = grow(low, high, middle, end);
    boxes_[static_cast<std::size_t>(at)].left = left;
    boxes_[static_cast<std::size_t>(at)].right = right;
    return at;
  }

  std::vector<Box> boxes_;
  std::vector<int> order_;
};

}  // namespace hydrostat::physics

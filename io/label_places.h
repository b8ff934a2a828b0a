#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace hydrostat::io {

/// An upright box of a picture [px], y down.
struct Box {
  double left, top, right, bottom;

  bool meets(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

constexpr double kLabelHeight = 13;  // [px] of a line of letters of 11 px
/// As wide as so many letters of 11 px are in the widest of usual fonts without serifs [px].
inline double label_width(std::size_t letters) { return 6.8 * static_cast<double>(letters); }

/// Where labels of a picture go that must not print over each other, nor over what is taken.
class LabelPlaces {
 public:
  void take(const Box& box) { taken_.push_back(box); }
  /// Takes the free place for a label that is nearest to having its middle at x, y, inside `within`: straight above or below by whole
  /// lines, or beside that. Returns its middle; none where all is taken.
  std::optional<std::pair<double, double>> place(double x, double y, double width, const Box& within);

 private:
  std::vector<Box> taken_;
};

}  // namespace hydrostat::io

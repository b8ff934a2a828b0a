#include "io/label_places.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::io {

std::optional<std::pair<double, double>> LabelPlaces::place(double x, double y, double width, const Box& within) {
  constexpr double kAside = 0.5;  // of the width [-]: how finely places beside are looked through
  const double half = width / 2, half_height = kLabelHeight / 2;
  const int rows = static_cast<int>(std::ceil((within.bottom - within.top) / kLabelHeight));
  const int columns = static_cast<int>(std::ceil((within.right - within.left) / (kAside * width)));
  std::optional<std::pair<double, double>> best;
  double least = 0;
  for (int row = -rows; row <= rows; ++row) {
    for (int column = -columns; column <= columns; ++column) {
      const double at_x = std::clamp(x + column * kAside * width, within.left + half, std::max(within.left, within.right - width) + half);
      const double at_y = y + row * kLabelHeight, away = std::hypot(at_x - x, at_y - y);
      const Box box{at_x - half, at_y - half_height, at_x + half, at_y + half_height};
      if (box.top < within.top || box.bottom > within.bottom || (best && away >= least)) continue;
      if (std::any_of(taken_.begin(), taken_.end(), [&](const Box& other) { return box.meets(other); })) continue;
      best = {at_x, at_y};
      least = away;
    }
  }
  if (best) take({best->first - half, best->second - half_height, best->first + half, best->second + half_height});
  return best;
}

}  // namespace hydrostat::io

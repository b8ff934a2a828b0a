#include "io/cut_polygons.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hydrostat::io::cut_polygons_test {
namespace {

TEST(CutPolygon, AnyStarIsFilledOnceByItsTriangles) {
  for (const int corners : {3, 4, 5, 50, 501, 20001}) {
    SCOPED_TRACE(corners);
    Eigen::Matrix3Xd star(3, corners);
    for (int i = 0; i < corners; ++i) {  // in a slanted plane; every other corner turns to the right
      const double angle = 2 * std::numbers::pi * i / corners, radius = i % 2 == 0 ? 1 : 0.6;
      star.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0.5 * radius * std::cos(angle);
    }
    const std::vector<Eigen::Vector3i> triangles = cut_polygon(star);
    ASSERT_EQ(static_cast<int>(triangles.size()), corners - 2);
    double whole = 0, cut = 0;  // twice the areas as seen from above
    const auto area = [&](int a, int b, int c) {
      const Eigen::Vector3d u = star.col(b) - star.col(a), v = star.col(c) - star.col(a);
      return u.x() * v.y() - u.y() * v.x();
    };
    for (int i = 1; i + 1 < corners; ++i) whole += area(0, i, i + 1);
    for (const Eigen::Vector3i& t : triangles) {
      EXPECT_GT(area(t[0], t[1], t[2]), 0);
      cut += area(t[0], t[1], t[2]);
    }
    EXPECT_NEAR(cut, whole, 1e-9);
  }
}

}  // namespace
}  // namespace hydrostat::io::cut_polygons_test

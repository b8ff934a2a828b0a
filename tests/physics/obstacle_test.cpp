#include "physics/obstacle.h"

#include <gtest/gtest.h>

#include "tests/physics/obstacle_shapes.h"
#include "tests/sanitizers.h"

namespace hydrostat::physics::obstacle_test {
namespace {

template <typename Dimension>
class Obstacles : public testing::Test {};
TYPED_TEST_SUITE(Obstacles, BothDimensions, DimensionName);

template <int Dim>
std::vector<ObstacleOf<Dim>> one_of_each(std::mt19937& random) {
  std::vector<ObstacleOf<Dim>> obstacles(4);
  obstacles[1].shape = BoxOf<Dim>{vec<Dim>(0.5, 0.3, 0.4)};
  obstacles[2].shape = Ball{0.4};
  obstacles[3].shape = mesh_of<Dim>(four_legged<Dim>());
  for (ObstacleOf<Dim>& obstacle : obstacles) {
    obstacle.place = random_points<Dim>(random, 1, 0.3);
    obstacle.turn = random_rotation<Dim>(random);
  }
  return obstacles;
}

TYPED_TEST(Obstacles, HaveAUnitNormalThatIsTheSlopeOfTheirDistance) {
  constexpr int Dim = TypeParam::kDim;
  constexpr double kStep = 1e-6;  // [m]
  int compared = 0;
  for (unsigned seed = 0; seed < trials(20u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const VectorOf<Dim> travel = random_points<Dim>(random, 1, 1);
    for (const ObstacleOf<Dim>& obstacle : one_of_each<Dim>(random)) {
      for (int n = 0; n < 20; ++n) {
        const VectorOf<Dim> point = travel + random_points<Dim>(random, 1, 1).col(0);
        VectorOf<Dim> normal, ahead_normal, slope;
        const double here = signed_distance<Dim>(obstacle, travel, point, normal);
        bool is_smooth = true;  // next to the middle of the shape the nearest place jumps
        for (int d = 0; d < Dim; ++d) {
          const VectorOf<Dim> step = kStep * VectorOf<Dim>::Unit(d);
          slope[d] = signed_distance<Dim>(obstacle, travel, point + step, ahead_normal) / (2 * kStep);
          is_smooth &= (ahead_normal - normal).norm() < 1e-3;
          slope[d] -= signed_distance<Dim>(obstacle, travel, point - step, ahead_normal) / (2 * kStep);
          is_smooth &= (ahead_normal - normal).norm() < 1e-3;
        }
        EXPECT_NEAR(normal.norm(), 1, 1e-12);
        if (!is_smooth) continue;
        EXPECT_LT((slope - normal).norm(), 1e-6) << "shape " << obstacle.shape.index() << " at " << here;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 70 * trials(20));
}

TYPED_TEST(Obstacles, MadeOfFacesAreAsFarAsTheShapeThatTheyBound) {
  constexpr int Dim = TypeParam::kDim;
  std::mt19937 random(1);
  ObstacleOf<Dim> box, faces;
  const VectorOf<Dim> half_extents = vec<Dim>(0.6, 0.2, 0.3);
  box.shape = BoxOf<Dim>{half_extents};
  faces.shape = box_mesh<Dim>(half_extents);
  for (int n = 0; n < trials(2000); ++n) {
    const VectorOf<Dim> point = random_points<Dim>(random, 1, 0.9), nowhere = VectorOf<Dim>::Zero();
    VectorOf<Dim> of_box, of_faces;
    const double distance = signed_distance<Dim>(box, nowhere, point, of_box);
    EXPECT_NEAR(signed_distance<Dim>(faces, nowhere, point, of_faces), distance, 1e-12);
    EXPECT_LT((of_box - of_faces).norm(), 1e-9);
    EXPECT_LE(distance_at_least<Dim>(faces, nowhere, point), std::max(0.0, distance) + 1e-12);
  }
}

TYPED_TEST(Obstacles, TellInsideFromOutsideByTheirCornersAsAStarDoes) {
  constexpr int Dim = TypeParam::kDim;
  // A ball whose radius waves: hollows between points, the sign known from the radius alone.
  const auto radius = [](const VectorOf<Dim>& direction) { return 1 + 0.4 * std::sin(9 * direction.x()) * direction.y(); };
  const ClosedMeshOf<Dim> star = mesh_of<Dim>(bar<Dim>(12, 12, 12, 1.0 / 6), [&](const VectorOf<Dim>& x) -> VectorOf<Dim> {
    const VectorOf<Dim> centred = x.array() - 1;
    return radius(centred.normalized()) * centred.normalized();
  });
  std::mt19937 random(1);
  int told = 0;
  for (int n = 0; n < trials(3000); ++n) {
    const VectorOf<Dim> point = random_points<Dim>(random, 1, 1.5);
    VectorOf<Dim> normal;
    const double margin = point.norm() - radius(point.normalized());
    if (std::abs(margin) < 0.15) continue;  // faces cut the waves' corners
    EXPECT_EQ(star.signed_distance(point, normal) > 0, margin > 0) << point.transpose();
    ++told;
  }
  EXPECT_GT(told, trials(3000) / 2);
}

TYPED_TEST(Obstacles, AreRefusedWithAWordWhereTheirFacesDoNotClose) {
  constexpr int Dim = TypeParam::kDim;
  using Faces = typename ClosedMeshOf<Dim>::Faces;
  const ClosedMeshOf<Dim> box = box_mesh<Dim>(VectorOf<Dim>::Ones());
  const PointsOf<Dim>& vertices = box.vertices();
  EXPECT_EQ(broken_mesh_rule<Dim>(vertices, box.faces()), "");
  EXPECT_NE(broken_mesh_rule<Dim>(vertices, Faces(Dim, 0)), "");
  EXPECT_NE(broken_mesh_rule<Dim>(vertices, box.faces().leftCols(box.faces().cols() - 1)), "");
  Faces turned = box.faces();
  turned.row(0).swap(turned.row(1));
  EXPECT_EQ(broken_mesh_rule<Dim>(vertices, turned), "its faces look inward");
  Faces one_turned = box.faces();
  std::swap(one_turned(0, 3), one_turned(1, 3));
  EXPECT_NE(broken_mesh_rule<Dim>(vertices, one_turned), "");
  Faces beyond = box.faces();
  beyond(0, 2) = static_cast<int>(vertices.cols());
  EXPECT_NE(broken_mesh_rule<Dim>(vertices, beyond), "");
  Faces flat = box.faces();
  flat(1, 2) = flat(0, 2);
  EXPECT_NE(broken_mesh_rule<Dim>(vertices, flat), "");
  PointsOf<Dim> nowhere = vertices;
  nowhere(0, 0) = std::nan("");
  EXPECT_NE(broken_mesh_rule<Dim>(nowhere, box.faces()), "");
}

TYPED_TEST(Obstacles, HaveTheirCornersWhereTheyArePointed) {
  constexpr int Dim = TypeParam::kDim;
  ObstacleOf<Dim> box, faces;
  box.shape = BoxOf<Dim>{VectorOf<Dim>::Ones()};
  faces.shape = box_mesh<Dim>(VectorOf<Dim>::Ones());
  box.place = faces.place = vec<Dim>(1, 2, 3);
  const CornersOf<Dim> of_box = corners_of(box), of_faces = corners_of(faces);
  ASSERT_EQ(of_box.places.cols(), 1 << Dim);
  ASSERT_EQ(of_faces.places.cols(), 1 << Dim);  // none of those inside the sides
  for (Eigen::Index c = 0; c < of_box.places.cols(); ++c) {
    Eigen::Index same;
    EXPECT_LT((of_faces.places.colwise() - of_box.places.col(c)).colwise().norm().minCoeff(&same), 1e-12);
    EXPECT_GT(of_faces.normals.col(same).dot(of_box.normals.col(c)), 0.99);
  }
}

}  // namespace
}  // namespace hydrostat::physics::obstacle_test

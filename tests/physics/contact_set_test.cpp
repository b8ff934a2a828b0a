#include "physics/contact_set.h"

#include <gtest/gtest.h>

#include "tests/physics/method_cases.h"
#include "tests/physics/obstacle_shapes.h"

namespace hydrostat::physics::contact_set_test {
namespace {

template <typename Dimension>
class ContactSets : public testing::Test {};
TYPED_TEST_SUITE(ContactSets, BothDimensions, DimensionName);

/// A bar of one cell of 1 m whose bottom lies on y = 0, over one obstacle.
template <int Dim>
SceneOf<Dim> over(const ObstacleOf<Dim>& obstacle) {
  SceneOf<Dim> scene = scene_of(bar<Dim>(1, 1, 1, 1.0), {});
  scene.has_ground = false;
  scene.obstacles = {obstacle};
  touch_with_whole_surface(scene);
  return scene;
}

/// All that touches or nearly does, brought to the rest shape.
template <int Dim>
std::vector<ContactOf<Dim>> contacts_at_rest(const SceneOf<Dim>& scene, double reach) {
  ContactSet<Dim> set(scene);
  const StateOf<Dim> rest{scene.body.rest, scene.body.rest};
  set.find(rest, reach);
  std::vector<ContactOf<Dim>> found;
  for (ContactOf<Dim> contact : set.candidates()) {
    set.update(rest.x, rest.obstacle_travel, contact);
    if (contact.gap < reach) found.push_back(contact);
  }
  return found;
}

TYPED_TEST(ContactSets, AreEmptyWhereThereIsNothingToTouchOrNothingToTouchWith) {
  constexpr int Dim = TypeParam::kDim;
  SceneOf<Dim> scene = scene_of(bar<Dim>(1, 1, 1, 1.0), {0, 1});
  EXPECT_FALSE(ContactSet<Dim>(scene).is_empty());
  scene.has_ground = false;
  EXPECT_TRUE(ContactSet<Dim>(scene).is_empty());
  scene.obstacles.resize(1);
  EXPECT_FALSE(ContactSet<Dim>(scene).is_empty());
  scene.contact_points = {};
  EXPECT_TRUE(ContactSet<Dim>(scene).is_empty());
}

TYPED_TEST(ContactSets, FindTheEdgeOfABoxInTheMiddleOfASide) {
  constexpr int Dim = TypeParam::kDim;
  for (const double height : {-0.05, -1e-3, 0.0, 0.05}) {
    SCOPED_TRACE(height);
    ObstacleOf<Dim> box;
    const double half = 0.3;
    box.shape = BoxOf<Dim>{vec<Dim>(half, half, 5)};
    box.turn = tilt<Dim>(45);
    box.place = vec<Dim>(0.4, -height - half * std::sqrt(2), 0.5);  // its edge along z, `height` below the body
    const std::vector<ContactOf<Dim>> found = contacts_at_rest(over(box), 0.1);
    // In 3D the edge crosses the front, the back and the diagonal of the bottom; a side where one end lies deep hides no
    // edge.
    EXPECT_EQ(found.size(), Dim == 3 ? 3 : 1);
    for (const ContactOf<Dim>& contact : found) {
      EXPECT_EQ(contact.point_count, 2);
      EXPECT_NEAR(contact.gap, height, 1e-6);
      EXPECT_LT((contact.normal - VectorOf<Dim>::UnitY()).norm(), 1e-6);
      EXPECT_NEAR(contact.of(bar<Dim>(1, 1, 1, 1.0).rest).x(), 0.4, 1e-3);  // where a millionth of the gap decides
    }
  }
}

TYPED_TEST(ContactSets, FindABallInTheMiddleOfAFace) {
  constexpr int Dim = TypeParam::kDim;
  for (const double height : {-0.05, 0.0, 0.05}) {
    SCOPED_TRACE(height);
    ObstacleOf<Dim> ball;
    ball.shape = Ball{0.15};
    ball.place = vec<Dim>(0.3, -height - 0.15, 0.25);
    const std::vector<ContactOf<Dim>> found = contacts_at_rest(over(ball), 0.06);
    int faces = 0;
    for (const ContactOf<Dim>& contact : found) {
      if (contact.point_count != Dim) continue;
      ++faces;
      EXPECT_NEAR(contact.gap, height, 1e-6);
      EXPECT_LT((contact.normal - VectorOf<Dim>::UnitY()).norm(), 1e-6);
      EXPECT_LT((contact.of(bar<Dim>(1, 1, 1, 1.0).rest) - vec<Dim>(0.3, 0, 0.25)).norm(), 1e-3);
    }
    EXPECT_EQ(faces, 1);
  }
}

TYPED_TEST(ContactSets, LeaveAFlatSideOnAFlatSideToTheirPoints) {
  constexpr int Dim = TypeParam::kDim;
  for (const bool as_mesh : {false, true}) {
    ObstacleOf<Dim> box;
    const VectorOf<Dim> half_extents = vec<Dim>(3, 0.5, 3);
    if (as_mesh) {
      box.shape = box_mesh<Dim>(half_extents);
    } else {
      box.shape = BoxOf<Dim>{half_extents};
    }
    box.place = vec<Dim>(0.5, -0.501, 0.5);
    const std::vector<ContactOf<Dim>> found = contacts_at_rest(over(box), 0.01);
    EXPECT_EQ(found.size(), Dim == 3 ? 4 : 2);
    for (const ContactOf<Dim>& contact : found) {
      EXPECT_EQ(contact.point_count, 1);
      EXPECT_NEAR(contact.gap, 0.001, 1e-12);
    }
  }
}

TEST(ContactSet, FindsTheCornerOfABoxInTheMiddleOfAFace) {
  for (const bool as_mesh : {false, true}) {
    for (const double height : {-0.05, 0.0, 0.05}) {
      SCOPED_TRACE(height);
      const Eigen::Vector3d half_extents(0.2, 0.2, 0.2);
      ObstacleOf<3> box;
      if (as_mesh) {
        box.shape = box_mesh<3>(half_extents);
      } else {
        box.shape = BoxOf<3>{half_extents};
      }
      box.turn = turn_to<3>(half_extents.normalized()).transpose();
      box.place = Eigen::Vector3d(0.25, -height - half_extents.norm(), 0.3);
      int faces = 0;
      for (const ContactOf<3>& contact : contacts_at_rest(over(box), 0.06)) {
        if (contact.point_count != 3) continue;
        ++faces;
        EXPECT_NEAR(contact.gap, height, 1e-9);
        EXPECT_LT((contact.normal - Eigen::Vector3d::UnitY()).norm(), 1e-9);
        EXPECT_LT((contact.of(bar(1, 1, 1, 1.0).rest) - Eigen::Vector3d(0.25, 0, 0.3)).norm(), 1e-9);
      }
      EXPECT_EQ(faces, 1);
    }
  }
}

TYPED_TEST(ContactSets, ShareALoadAmongPointsWithTheSameForceAndMoment) {
  constexpr int Dim = TypeParam::kDim;
  std::mt19937 random(1);
  for (int n = 0; n < trials(20); ++n) {
    ObstacleOf<Dim> ball;
    ball.shape = Ball{0.3};
    ball.place = vec<Dim>(0.3, -0.28, 0.35) + random_points<Dim>(random, 1, 0.1).col(0);
    SceneOf<Dim> scene = over(ball);
    add_skin_points(scene, 3, static_cast<unsigned>(n));  // points that hang on several nodes
    scene.contact_faces.row(0).setConstant(scene.contact_points.count() - 1);
    ContactSet<Dim> set(scene);
    const StateOf<Dim> rest{scene.body.rest, scene.body.rest};
    set.find(rest, 1);
    for (ContactOf<Dim> contact : set.candidates()) {
      set.update(rest.x, rest.obstacle_travel, contact);
      if (!std::isfinite(contact.gap)) continue;
      VectorOf<Dim> of_points = VectorOf<Dim>::Zero();
      double shares = 0, weights = 0;
      for (int k = 0; k < contact.point_count; ++k) {
        of_points += contact.shares[k] * scene.contact_points.of(rest.x, contact.points[k]);
        shares += contact.shares[k];
      }
      for (int k = 0; k < contact.node_count; ++k) weights += contact.weights[k];
      EXPECT_LT((of_points - contact.of(rest.x)).norm(), 1e-12);
      EXPECT_NEAR(shares, 1, 1e-12);
      EXPECT_NEAR(weights, 1, 1e-12);
    }
  }
}

}  // namespace
}  // namespace hydrostat::physics::contact_set_test

#include "physics/seam.h"

#include <gtest/gtest.h>

#include "tests/physics/seam_scene.h"

namespace hydrostat::physics::seam_test {
namespace {

template <typename Dimension>
class Seams : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Seams, Dimensions);

template <int Dim>
VectorOf<Dim> area_of(const ElementMesh<Dim>& mesh, const SeamFace& face) {
  std::array<int, 4> nodes{};
  for (std::size_t k = 0; k < static_cast<std::size_t>(face.corner_count); ++k) nodes[k] = mesh.nodes(face.corners[0][k], face.elements[0]);
  return area_vector<Dim>(mesh.rest, nodes, face.corner_count);
}

std::vector<char> all_of(const std::vector<SeamFace>& faces) { return std::vector<char>(faces.size(), 1); }

/// Whatever zigzag the plane has become: its edge lies on the sides of the bar.
TYPED_TEST(Seams, HaveTheAreaOfTheSectionThatTheyCut) {
  constexpr int Dim = TypeParam::value;
  for (const bool of_boxes : {false, true}) {
    const ElementMesh<Dim> mesh = bar_mesh<Dim>(3, of_boxes);
    for (const double offset : {0.0, 0.011, -0.13, 0.2}) {
      SCOPED_TRACE(offset);
      VectorOf<Dim> sum = VectorOf<Dim>::Zero();
      const std::vector<SeamFace> faces = find_seam_faces<Dim>(mesh, {level_seam<Dim>(offset)});
      for (const SeamFace& face : faces) sum += area_of(mesh, face);
      EXPECT_NEAR(sum[1], std::pow(0.2, Dim - 1), 1e-12);
      EXPECT_EQ(count_parts(split_mesh(mesh, faces, all_of(faces)).mesh.nodes), 2);
    }
  }
}

TYPED_TEST(Seams, JoinTheSameNodesSeenFromBothSides) {
  constexpr int Dim = TypeParam::value;
  for (const bool of_boxes : {false, true}) {
    const ElementMesh<Dim> mesh = bar_mesh<Dim>(2, of_boxes);
    SeamOf<Dim> tilted;
    tilted.normal = VectorOf<Dim>::Ones().normalized();
    for (const SeamFace& face : find_seam_faces<Dim>(mesh, {tilted})) {
      for (std::size_t k = 0; k < static_cast<std::size_t>(face.corner_count); ++k) {
        EXPECT_EQ(mesh.nodes(face.corners[0][k], face.elements[0]), mesh.nodes(face.corners[1][k], face.elements[1]));
      }
    }
  }
}

TYPED_TEST(Seams, PartNothingUntilTheyAreBrokenAllTheWay) {
  constexpr int Dim = TypeParam::value;
  const ElementMesh<Dim> mesh = bar_mesh<Dim>(3, false);
  const std::vector<SeamFace> faces = find_seam_faces<Dim>(mesh, {level_seam<Dim>(0)});
  const SplitMesh<Dim> whole = split_mesh(mesh, faces, std::vector<char>(faces.size(), 0));
  EXPECT_EQ(whole.mesh.nodes, mesh.nodes);
  EXPECT_EQ(whole.mesh.rest, mesh.rest);
  std::vector<char> is_broken = all_of(faces);
  is_broken.back() = 0;
  const SplitMesh<Dim> nearly = split_mesh(mesh, faces, is_broken);
  EXPECT_EQ(count_parts(nearly.mesh.nodes), 1);
  EXPECT_GT(nearly.mesh.rest.cols(), mesh.rest.cols());
  const SplitMesh<Dim> apart = split_mesh(mesh, faces, all_of(faces));
  for (Eigen::Index n = 0; n < apart.origin.size(); ++n) {
    EXPECT_EQ(apart.mesh.rest.col(n), mesh.rest.col(apart.origin[n]));
    EXPECT_TRUE(n >= mesh.rest.cols() || apart.origin[n] == n);
  }
}

TYPED_TEST(Seams, ThatCrossMakeFourParts) {
  constexpr int Dim = TypeParam::value;
  SeamOf<Dim> upright;
  upright.normal = VectorOf<Dim>::UnitX();
  for (const bool of_boxes : {false, true}) {
    const ElementMesh<Dim> mesh = bar_mesh<Dim>(2, of_boxes);
    const std::vector<SeamFace> faces = find_seam_faces<Dim>(mesh, {level_seam<Dim>(0), upright});
    EXPECT_EQ(count_parts(split_mesh(mesh, faces, all_of(faces)).mesh.nodes), 4);
  }
}

TYPED_TEST(Seams, LieWhereTheyAreMarkedAlone) {
  constexpr int Dim = TypeParam::value;
  const ElementMesh<Dim> mesh = bar_mesh<Dim>(4, false);
  SeamOf<Dim> half = level_seam<Dim>(0);
  half.high[0] = 0;
  const std::vector<SeamFace> faces = find_seam_faces<Dim>(mesh, {half});
  ASSERT_FALSE(faces.empty());
  const SplitMesh<Dim> slit = split_mesh(mesh, faces, all_of(faces));
  EXPECT_EQ(count_parts(slit.mesh.nodes), 1);
  for (Eigen::Index n = mesh.rest.cols(); n < slit.origin.size(); ++n) EXPECT_LT(slit.mesh.rest(0, n), 1e-9);
  // A single face opens nowhere: all its corners hang together around it.
  SeamOf<Dim> inner = half;
  inner.low = VectorOf<Dim>::Constant(-0.026);
  inner.high = VectorOf<Dim>::Constant(-0.024);
  EXPECT_TRUE(find_seam_faces<Dim>(mesh, {inner}).empty());
}

TYPED_TEST(Seams, KeepTheMassOfEveryNode) {
  constexpr int Dim = TypeParam::value;
  for (const bool of_boxes : {false, true}) {
    const FractureOf<Dim> fracture = fracture_of<Dim>(bar_mesh<Dim>(2, of_boxes), {level_seam<Dim>(0.07)});
    BodyOf<Dim> whole = fracture.make_body(fracture.mesh);
    whole.held = {0, 3};
    const SplitMesh<Dim> apart = split_mesh(fracture.mesh, fracture.faces, all_of(fracture.faces));
    const BodyOf<Dim> body = split_body(fracture, whole, apart);
    Eigen::VectorXd mass = Eigen::VectorXd::Zero(whole.node_count());
    for (int n = 0; n < body.node_count(); ++n) mass[apart.origin[n]] += body.mass[n];
    EXPECT_LT((mass - whole.mass).cwiseAbs().maxCoeff(), 1e-14 * whole.mass.sum());
    EXPECT_GE(body.held.size(), whole.held.size());
    const Eigen::VectorXi edges = whole_edges(whole, body, apart.origin);
    for (int e = 0; e < body.edge_count(); ++e) EXPECT_DOUBLE_EQ(body.rest_length[e], whole.rest_length[edges[e]]);
  }
}

}  // namespace
}  // namespace hydrostat::physics::seam_test

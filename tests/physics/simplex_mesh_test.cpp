#include "physics/simplex_mesh.h"

#include <gtest/gtest.h>

#include "tests/physics/lattice_scene.h"
#include "tests/physics/obstacle_shapes.h"

namespace hydrostat::physics::simplex_mesh_test {
namespace {

template <typename Dimension>
class SimplexMeshes : public testing::Test {};
TYPED_TEST_SUITE(SimplexMeshes, BothDimensions, DimensionName);

/// The surface of a mesh.
template <int Dim>
ClosedMeshOf<Dim> surface_of(const SimplexMeshOf<Dim>& mesh) {
  return mesh_of<Dim>(
      make_body<Dim>(mesh.nodes, mesh.simplices, edges_of(mesh), Eigen::VectorXd::Ones(mesh.simplices.cols()), {}));
}

/// Simplices that fit have a closed surface without inner faces: its volume is theirs.
template <int Dim>
void expect_to_fit(const SimplexMeshOf<Dim>& mesh, double least_quality) {
  EXPECT_GT(shape_qualities(mesh).minCoeff(), least_quality);
  const ClosedMeshOf<Dim> surface = surface_of(mesh);  // asserts the rule
  ASSERT_EQ(broken_mesh_rule<Dim>(surface.vertices(), surface.faces()), "");
  double enclosed = 0;
  for (Eigen::Index f = 0; f < surface.faces().cols(); ++f) {
    BlockOf<Dim> corners;
    for (int k = 0; k < Dim; ++k) corners.col(k) = surface.vertices().col(surface.faces()(k, f));
    enclosed += corners.determinant() / kSimplexFactor<Dim>;
  }
  EXPECT_NEAR(enclosed, volume(mesh), 1e-12 * volume(mesh));
  std::vector<char> used(static_cast<std::size_t>(mesh.nodes.cols()), 0);
  for (const int node : mesh.simplices.reshaped()) used[static_cast<std::size_t>(node)] = 1;
  EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0) << "a node hangs on nothing";
}

TYPED_TEST(SimplexMeshes, FillTheirShapesExactly) {
  constexpr int Dim = TypeParam::kDim;
  const VectorOf<Dim> size = vec<Dim>(0.3, 0.7, 1.1);
  for (const int n : {1, 2, 3, 5}) {
    SCOPED_TRACE(n);
    const Eigen::Matrix<int, Dim, 1> cells = Eigen::Vector3i(n, n + 1, 2 * n).head<Dim>();
    const SimplexMeshOf<Dim> box = mesh_of_box<Dim>(size, cells);
    expect_to_fit(box, 0.3);
    EXPECT_NEAR(volume(box), size.prod(), 1e-12);
    EXPECT_LT((box.nodes.rowwise().maxCoeff() - size / 2).norm(), 1e-12);
    EXPECT_LT((box.nodes.rowwise().minCoeff() + size / 2).norm(), 1e-12);

    const SimplexMeshOf<Dim> pyramid = mesh_of_pyramid<Dim>(size, n);
    expect_to_fit(pyramid, 0.15);  // a quarter as wide as deep
    EXPECT_NEAR(volume(pyramid), size.prod() / Dim, 1e-12);
    EXPECT_EQ(pyramid.simplices.cols(), (Dim == 3 ? 4 : 2) * std::lround(std::pow(n, Dim)));

    const SimplexMeshOf<Dim> simplex = mesh_of_regular_simplex<Dim>(0.4, n);
    expect_to_fit(simplex, 0.7);
    EXPECT_NEAR(volume(simplex), Dim == 3 ? 0.064 / std::sqrt(72) : 0.16 * std::sqrt(3) / 4, 1e-12);
    EXPECT_LT((simplex.nodes.rowwise().mean() - VectorOf<Dim>::Zero()).norm(), 1e-12);

    if (n < 2) continue;
    const SimplexMeshOf<Dim> ball = mesh_of_ball<Dim>(0.5, n);
    expect_to_fit(ball, 0.4);
    EXPECT_NEAR(volume(ball), Dim == 3 ? M_PI / 48 : M_PI / 16, 1e-12);
  }
}

TYPED_TEST(SimplexMeshes, OfBoxesHaveTheLatticesNodes) {
  constexpr int Dim = TypeParam::kDim;
  const VectorOf<Dim> size = vec<Dim>(0.3, 0.7, 1.1);
  const Eigen::Matrix<int, Dim, 1> cells = Eigen::Vector3i(2, 3, 4).head<Dim>();
  const BoxMeshOf<Dim> lattice = lattice_of_box<Dim>(size, cells);
  const SimplexMeshOf<Dim> mesh = mesh_of_box<Dim>(size, cells);
  ASSERT_EQ(lattice.nodes.cols(), mesh.nodes.cols());
  for (Eigen::Index n = 0; n < mesh.nodes.cols(); ++n) {
    EXPECT_LT((lattice.nodes.colwise() - mesh.nodes.col(n)).colwise().norm().minCoeff(), 1e-12);
  }
  for (Eigen::Index c = 0; c < lattice.boxes.cols(); ++c) {
    for (int d = 0; d < Dim; ++d) {
      const VectorOf<Dim> edge = lattice.nodes.col(lattice.boxes(1 << d, c)) - lattice.nodes.col(lattice.boxes(0, c));
      EXPECT_LT((edge - size[d] / cells[d] * VectorOf<Dim>::Unit(d)).norm(), 1e-12);
    }
  }
}

TYPED_TEST(SimplexMeshes, OfBallsAreRound) {
  constexpr int Dim = TypeParam::kDim;
  for (const int cells : {8, 12}) {
    const ClosedMeshOf<Dim> surface = surface_of(mesh_of_ball<Dim>(2, cells));
    const Eigen::RowVectorXd radius = surface.vertices().colwise().norm();
    EXPECT_NEAR(radius.minCoeff(), radius.maxCoeff(), 1e-12);
    EXPECT_NEAR(radius.maxCoeff(), 1, Dim == 3 ? 0.012 : 0.004);
  }
}

TYPED_TEST(SimplexMeshes, InsideABoxThatIsAMeshFillItExactly) {
  constexpr int Dim = TypeParam::kDim;
  const VectorOf<Dim> half = vec<Dim>(0.3, 0.2, 0.4);
  const SimplexMeshOf<Dim> mesh = mesh_inside<Dim>(box_mesh<Dim>(half), 0.11);
  expect_to_fit(mesh, 0.3);
  EXPECT_NEAR(volume(mesh), (2 * half).prod(), 1e-9);
}

TYPED_TEST(SimplexMeshes, InsideABallComeNearerWithSmallerCells) {
  constexpr int Dim = TypeParam::kDim;
  const ClosedMeshOf<Dim> surface = surface_of(mesh_of_ball<Dim>(2, 10));
  const double whole = Dim == 3 ? 4 * M_PI / 3 : M_PI;
  double last = 1;
  for (const double cell : {0.5, 0.25, 0.15}) {
    const SimplexMeshOf<Dim> mesh = mesh_inside<Dim>(surface, cell);
    expect_to_fit(mesh, 0.05);
    const double error = std::abs(volume(mesh) / whole - 1);
    EXPECT_LT(error, 0.5 * cell * cell);
    EXPECT_LT(error, last);
    last = error;
  }
}

TYPED_TEST(SimplexMeshes, InsideATurnedBoxAreGoodForManyTurns) {
  constexpr int Dim = TypeParam::kDim;
  const ClosedMeshOf<Dim> upright = box_mesh<Dim>(vec<Dim>(0.5, 0.4, 0.3));
  for (unsigned seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const ClosedMeshOf<Dim> surface(random_rotation<Dim>(random) * upright.vertices(), upright.faces());
    const SimplexMeshOf<Dim> mesh = mesh_inside<Dim>(surface, 0.2);
    expect_to_fit(mesh, 0.01);
    EXPECT_NEAR(volume(mesh) / vec<Dim>(1, 0.8, Dim == 3 ? 0.6 : 1).prod(), 1, Dim == 3 ? 0.15 : 0.05);
  }
}

TEST(SimplexMesh, KeepsTheCornersOfAConcaveOutline) {
  //  +--+
  //  |  |
  //  |  +----+
  //  |       |
  //  +-------+
  PointsOf<2> corners(2, 6);
  corners << 0, 2, 2, 0.7, 0.7, 0,  //
      0, 0, 0.6, 0.6, 1.7, 1.7;
  Eigen::Matrix2Xi sides(2, 6);
  for (int k = 0; k < 6; ++k) sides.col(k) << k, (k + 1) % 6;
  const SimplexMeshOf<2> mesh = mesh_inside<2>(ClosedMeshOf<2>(corners, sides), 0.25);
  expect_to_fit(mesh, 0.2);
  EXPECT_NEAR(volume(mesh), 2 * 0.6 + 0.7 * 1.1, 1e-6);
  for (int k = 0; k < 6; ++k) {
    EXPECT_LT((mesh.nodes.colwise() - corners.col(k)).colwise().norm().minCoeff(), 1e-12) << "corner " << k;
  }
}

}  // namespace
}  // namespace hydrostat::physics::simplex_mesh_test

#include "retarget/control_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "retarget/error.h"
#include "shapes.h"

namespace hydrostat::retarget::control_mesh_test {
namespace {

double tet_volume(const ControlMesh& mesh, Eigen::Index tet) {
  Eigen::Matrix3d spans;
  for (int k = 0; k < 3; ++k) spans.col(k) = mesh.nodes.col(mesh.tets(k + 1, tet)) - mesh.nodes.col(mesh.tets(0, tet));
  return spans.determinant() / 6;
}

double body_volume(const ControlMesh& mesh) {
  double volume = 0;
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) volume += mesh.tet_fill[t] * tet_volume(mesh, t);
  return volume;
}

struct NamedBody {
  const char* name;
  Character character;
};

Character boned(const SkinnedMesh& skin) { return {one_bone(), skin, {}}; }

std::vector<NamedBody> many_bodies() {
  SkinnedMesh shin = box_skin({-0.05, 0, -0.05}, {0.05, 1, 0.05});
  shin.vertices = Eigen::AngleAxisd(0.6, Eigen::Vector3d(0.3, 0.1, 1).normalized()).toRotationMatrix() * shin.vertices;
  const SkinnedMesh eyes = joined(ball_skin({0.3, 0.3, 0.3}), box_skin({0.1, 0.1, 0.35}, {0.15, 0.15, 0.4}));
  return {{"box", boned(box_skin({0, 0, 0}, {0.3, 0.7, 1.2}))},
          {"ball", boned(ball_skin({0.5, 0.5, 0.5}))},
          {"egg", boned(ball_skin({0.1, 0.3, 0.2}))},
          {"worm", worm()},
          {"two legs", two_legged(0.15)},
          {"slanted shin", boned(shin)},
          {"a part that floats", boned(eyes)}};
}

TEST(ControlMesh, IsOnePieceOfAboutTheWantedSize) {
  for (const auto& [name, character] : many_bodies()) {
    SCOPED_TRACE(name);
    for (const int wanted : {0, 150, 400}) {
      const ControlMesh mesh = build_control_mesh(character.skeleton, character.skin, {.nodes = wanted});
      EXPECT_EQ(count_pieces(mesh.tets), 1);
      EXPECT_EQ(mesh.pieces, 1);
      EXPECT_GE(mesh.node_count(), wanted ? 0.75 * wanted : 100);
      EXPECT_LE(mesh.node_count(), wanted ? 1.25 * wanted : 600);
    }
  }
}

/// A flat trunk, bone 0, on eight thin legs that spread, bones 1 to 8.
Character spider() {
  Character body;
  std::vector<Eigen::Vector3d> places{{0, 0.3, 0}};
  body.skin = ball_skin({0.2, 0.08, 0.3});
  for (auto vertex : body.skin.vertices.colwise()) vertex.y() += 0.3;
  for (int leg = 0; leg < 8; ++leg) {
    const double angle = (0.5 + leg) * M_PI / 4;
    const Eigen::Vector3d out(std::cos(angle), 0, std::sin(angle)), hip = 0.15 * out + Eigen::Vector3d(0, 0.3, 0);
    SkinnedMesh shank = box_skin({-0.02, -0.02, 0}, {0.02, 0.02, 0.5}, leg + 1);
    const auto spread = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), out - 0.7 * Eigen::Vector3d::UnitY());
    shank.vertices = (spread.toRotationMatrix() * shank.vertices).eval().colwise() + hip;
    body.skin = joined(body.skin, shank);
    places.push_back(hip);
  }
  body.skeleton = skeleton_of({-1, 0, 0, 0, 0, 0, 0, 0, 0}, places);
  return body;
}

TEST(ControlMesh, OfThinLegsHasAboutAsManyNodesAsWished) {
  const Character body = spider();
  for (const int wanted : {150, 200, 400}) {
    SCOPED_TRACE(wanted);
    EXPECT_NEAR(1.0 * build_control_mesh(body.skeleton, body.skin, {.nodes = wanted}).node_count() / wanted, 1, 0.15);
  }
}

TEST(ControlMesh, HasPositiveTetsAndWeightsThatSumToOne) {
  for (const auto& [name, character] : many_bodies()) {
    SCOPED_TRACE(name);
    const ControlMesh mesh = build_control_mesh(character.skeleton, character.skin);
    for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) EXPECT_GT(tet_volume(mesh, t), 0);
    EXPECT_GE(mesh.tet_fill.minCoeff(), 0.05);
    EXPECT_LE(mesh.tet_fill.maxCoeff(), 1.0);
    EXPECT_EQ(mesh.tets.cols(), 5 * mesh.cells);
    const std::set<int> used(mesh.tets.data(), mesh.tets.data() + mesh.tets.size());
    EXPECT_EQ(static_cast<int>(used.size()), mesh.node_count());
    EXPECT_EQ(*used.rbegin(), mesh.node_count() - 1);
    EXPECT_GE(mesh.bone_weights.minCoeff(), 0);
    EXPECT_LT((mesh.bone_weights.colwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
  }
}

TEST(ControlMesh, EdgesAreTheTetsEdgesOnceAndInOrder) {
  const Character body = two_legged(0.15);
  const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin);
  std::set<std::pair<int, int>> expected;
  for (const auto tet : mesh.tets.colwise()) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < i; ++j) expected.insert(std::minmax(tet[i], tet[j]));
    }
  }
  ASSERT_EQ(mesh.edges.cols(), static_cast<Eigen::Index>(expected.size()));
  Eigen::Index e = 0;
  for (const auto& [a, b] : expected) {
    EXPECT_EQ(mesh.edges(0, e), a);
    EXPECT_EQ(mesh.edges(1, e++), b);
  }
}

TEST(ControlMesh, HoldsTheVolumeOfTheSkin) {
  const ControlMesh box = build_control_mesh(one_bone(), box_skin({0, 0, 0}, {0.3, 0.7, 1.2}));
  EXPECT_NEAR(body_volume(box), 0.3 * 0.7 * 1.2,
              0.03 * 0.252);  // [m³]: half a voxel of skin, one voxel is a tenth of a cell
  const ControlMesh ball = build_control_mesh(one_bone(), ball_skin({0.5, 0.5, 0.5}));
  EXPECT_NEAR(body_volume(ball), std::numbers::pi / 6, 0.03 * 0.5236);
}

TEST(ControlMesh, BottomPlaneLiesOnTheSolesAndTheLatticeSpansTheBox) {
  const Character body = two_legged(0.15);
  const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin);
  EXPECT_LT((mesh.nodes.rowwise().minCoeff() - body.skin.vertices.rowwise().minCoeff()).norm(), 1e-12);
  EXPECT_LT((mesh.nodes.rowwise().maxCoeff() - body.skin.vertices.rowwise().maxCoeff()).norm(), 1e-12);
}

TEST(ControlMesh, AWormIsTwoCellsWide) {
  const Character body = worm();
  const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin);
  const Eigen::Vector3i lattice = mesh.cell_places.rowwise().maxCoeff().array() + 1;
  EXPECT_EQ(lattice[0], 2);
  EXPECT_EQ(lattice[1], 2);
}

/// Nodes that carry skin of both lower legs below the given height [m].
std::vector<int> nodes_of_both_legs(const ControlMesh& mesh, const SkinnedMesh& skin, double height) {
  std::set<int> left, right;
  for (Eigen::Index v = 0; v < skin.vertices.cols(); ++v) {
    const int bone = skin.skin_weights[static_cast<std::size_t>(v)][0].bone;
    if (skin.vertices(1, v) > height || bone == 0) continue;
    const auto cell = mesh.tets.middleCols(5 * mesh.vertex_cells[v], 5).reshaped();
    (bone == 2 ? left : right).insert(cell.begin(), cell.end());
  }
  std::vector<int> shared;
  std::set_intersection(left.begin(), left.end(), right.begin(), right.end(), std::back_inserter(shared));
  return shared;
}

TEST(ControlMesh, LegsNearerThanACellNeverShareANode) {
  for (const double gap : {0.03, 0.05, 0.1}) {
    SCOPED_TRACE("gap " + std::to_string(gap) + " m");
    const Character body = two_legged(gap);
    // Three cells across, so the middle column holds both legs; the gap is 0.14 to 0.43 of a cell.
    const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin, {.lattice = {3, 5, 1}});
    EXPECT_GE(mesh.copied_cells, 3);                                 // the middle column below the beam
    EXPECT_TRUE(nodes_of_both_legs(mesh, body.skin, 0.35).empty());  // the cells above share the beam's nodes
    EXPECT_EQ(count_pieces(mesh.tets), 1);
  }
}

TEST(ControlMesh, LegsThatTouchAreParted) {
  const Character body = two_legged(0);
  const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin, {.lattice = {3, 5, 1}});
  EXPECT_GT(mesh.copied_cells, 0);
  EXPECT_TRUE(nodes_of_both_legs(mesh, body.skin, 0.15).empty());
  EXPECT_EQ(count_pieces(mesh.tets), 1);
}

TEST(ControlMesh, InsideOutOrOpenSkinGivesTheSameBody) {
  const SkinnedMesh closed = ball_skin({0.5, 0.4, 0.6});
  const ControlMesh expected = build_control_mesh(one_bone(), closed, {.lattice = {5, 4, 6}});
  SkinnedMesh inside_out = closed;
  inside_out.triangles.row(0).swap(inside_out.triangles.row(1));
  SkinnedMesh open = closed;  // without its last triangles: a hole of a few squares
  open.triangles.conservativeResize(3, closed.triangles.cols() - 7);
  for (const SkinnedMesh& skin : {inside_out, open}) {
    const ControlMesh mesh = build_control_mesh(one_bone(), skin, {.lattice = {5, 4, 6}});
    EXPECT_EQ(mesh.nodes, expected.nodes);
    EXPECT_EQ(mesh.tets, expected.tets);
    EXPECT_LT((mesh.tet_fill - expected.tet_fill).cwiseAbs().maxCoeff(), 0.02);
  }
}

TEST(ControlMesh, OverlappingShellsAreOneSolid) {
  const SkinnedMesh two = joined(box_skin({0, 0, 0}, {0.6, 0.5, 0.5}), box_skin({0.4, 0, 0}, {1, 0.5, 0.5}));
  const ControlMesh mesh = build_control_mesh(one_bone(), two, {.lattice = {10, 5, 5}});
  EXPECT_EQ(mesh.cells, 250);
  EXPECT_GT(mesh.tet_fill.minCoeff(), 0.8);
}

TEST(ControlMesh, ASheetHasABody) {
  for (int axis = 0; axis < 3; ++axis) {
    SCOPED_TRACE("flat along axis " + std::to_string(axis));
    SkinnedMesh sheet = box_skin({0, 0, 0}, {1, 1, 1}, 0, 8);
    const Eigen::Index a_side = sheet.triangles.cols() / 6;
    sheet.triangles = Eigen::Matrix3Xi(sheet.triangles.middleCols(2 * axis * a_side, a_side));
    const Eigen::Index side_vertices = sheet.vertices.cols() / 6;
    sheet.vertices = Eigen::Matrix3Xd(sheet.vertices.middleCols(2 * axis * side_vertices, side_vertices));
    sheet.triangles.array() -= static_cast<int>(2 * axis * side_vertices);
    sheet.skin_weights.resize(static_cast<std::size_t>(side_vertices));
    const ControlMesh mesh = build_control_mesh(one_bone(), sheet);
    EXPECT_EQ(mesh.pieces, 1);
    EXPECT_GE(mesh.node_count(), 100);
    EXPECT_EQ((mesh.cell_places.row(axis).array() == 0).all(), true);
  }
}

TEST(ControlMesh, IsTheSameEveryTime) {
  const Character body = two_legged(0.05);
  const ControlMesh first = build_control_mesh(body.skeleton, body.skin);
  const ControlMesh second = build_control_mesh(body.skeleton, body.skin);
  EXPECT_EQ(first.nodes, second.nodes);
  EXPECT_EQ(first.tets, second.tets);
  EXPECT_EQ(first.tet_fill, second.tet_fill);
  EXPECT_EQ(first.vertex_cells, second.vertex_cells);
  EXPECT_EQ(first.bone_weights, second.bone_weights);
}

TEST(ControlMesh, RefusesASkinWithoutBody) {
  EXPECT_THROW(build_control_mesh(one_bone(), SkinnedMesh{}), Error);
  SkinnedMesh point = box_skin({0, 0, 0}, {0, 0, 0});
  EXPECT_THROW(build_control_mesh(one_bone(), point), Error);
  SkinnedMesh damaged = box_skin({0, 0, 0}, {1, 1, 1});
  damaged.vertices(1, 3) = std::nan("");
  EXPECT_THROW(build_control_mesh(one_bone(), damaged), Error);
}

TEST(ControlMesh, ALongThinBodyTakesMoreNodesThanWishedAndAThreadIsRefused) {
  for (const SkinnedMesh& skin : {box_skin({0, 0, 0}, {0.2, 2, 0}), box_skin({0, 0, 0}, {0.1, 0.1, 4})}) {
    const ControlMesh mesh = build_control_mesh(one_bone(), skin, {.nodes = 20});
    EXPECT_EQ(mesh.pieces, 1);
    EXPECT_GT(mesh.node_count(), 20);
    EXPECT_LT(mesh.node_count(), 400);
  }
  EXPECT_THROW(build_control_mesh(one_bone(), box_skin({0, 0, 0}, {1e-4, 1e-4, 1}), {.nodes = 20}), Error);
}

TEST(BodyOptions, NameTheRuleTheyBreak) {
  EXPECT_EQ(broken_rule(BodyOptions{}), "");
  EXPECT_NE(broken_rule(BodyOptions{.nodes = 5}), "");
  EXPECT_NE(broken_rule(BodyOptions{.nodes = 100000}), "");
  EXPECT_NE(broken_rule(BodyOptions{.mirror_axis = 1}), "");
  EXPECT_EQ(broken_rule(BodyOptions{.mirror_axis = 2}), "");
  EXPECT_NE(broken_rule(BodyOptions{.lattice = {3, 0, 4}}), "");
  EXPECT_NE(broken_rule(BodyOptions{.least_fill = 0.9}), "");
}

}  // namespace
}  // namespace hydrostat::retarget::control_mesh_test

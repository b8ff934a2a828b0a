#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "retarget/control_mesh.h"
#include "shapes.h"

namespace hydrostat::retarget::embedding_test {
namespace {

std::vector<Character> some_bodies() { return {worm(), two_legged(0.1), {one_bone(), ball_skin({0.2, 0.5, 0.3}), {}}}; }

TEST(Embedding, WeightsAreAPartitionOfUnity) {
  for (const Character& body : some_bodies()) {
    const Embedding embedding = embed_skin(build_control_mesh(body.skeleton, body.skin), body.skin);
    EXPECT_GE(embedding.weights.minCoeff(), 0);
    EXPECT_LT((embedding.weights.colwise().sum().array() - 1).abs().maxCoeff(), 1e-14);
  }
}

TEST(Embedding, GivesTheBindPoseBack) {
  for (const Character& body : some_bodies()) {
    const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin, {.least_fill = 0});
    const Embedding embedding = embed_skin(mesh, body.skin);
    EXPECT_LT((embedded_positions(embedding, mesh.nodes) - body.skin.vertices).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT(embedding.max_miss, 1e-12);
  }
}

TEST(Embedding, MissesByNoMoreThanTheLeastFill) {
  for (const Character& body : some_bodies()) {
    const BodyOptions options{.least_fill = 0.3};
    const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin, options);
    const Embedding embedding = embed_skin(mesh, body.skin);
    EXPECT_LE(embedding.max_miss, options.least_fill * mesh.cell_size.norm());
    const double miss = (embedded_positions(embedding, mesh.nodes) - body.skin.vertices).colwise().norm().maxCoeff();
    EXPECT_NEAR(miss, embedding.max_miss, 1e-12);
  }
}

TEST(Embedding, CarriesAnAffineMapExactly) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> number(-1, 1);
    Eigen::Affine3d map = Eigen::Affine3d::Identity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 4; ++j) map(i, j) = number(random);
    }
    const Character body = two_legged(0.1);
    const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin, {.lattice = {3, 5, 1}, .least_fill = 0});
    const Eigen::Matrix3Xd moved = embedded_positions(embed_skin(mesh, body.skin), map * mesh.nodes);
    EXPECT_LT((moved - map * body.skin.vertices).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Embedding, NodesAreThoseOfTheTet) {
  const Character body = worm();
  const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin);
  const Embedding embedding = embed_skin(mesh, body.skin);
  for (Eigen::Index p = 0; p < embedding.count(); ++p) EXPECT_EQ(embedding.nodes.col(p), mesh.tets.col(embedding.tets[p]));
}

TEST(ContactPoints, LieApartAndCoverTheSkin) {
  const Character body = worm();
  const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin);
  const ContactPoints contact = contact_points(mesh, body.skeleton, body.skin);
  const double spacing = 0.35 * std::cbrt(mesh.cell_size.prod());
  const Eigen::Matrix3Xd points = body.skin.vertices(Eigen::all, contact.vertices);
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    for (Eigen::Index q = 0; q < p; ++q) EXPECT_GE((points.col(p) - points.col(q)).norm(), spacing * (1 - 1e-12));
  }
  for (const auto vertex : body.skin.vertices.colwise())
    EXPECT_LT((points.colwise() - vertex).colwise().norm().minCoeff(), spacing);
  EXPECT_LT((embedded_positions(contact.embedding, mesh.nodes) - points).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ContactPoints, OfAMirrorImageOfItselfAreOneWhereTheyAreToBeSymmetric) {
  for (const Character& body : some_bodies()) {
    const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin);
    const ContactPoints contact = contact_points(mesh, body.skeleton, body.skin, /*symmetric=*/true);
    const Eigen::Matrix3Xd points = body.skin.vertices(Eigen::all, contact.vertices);
    const double spacing = 0.35 * std::cbrt(mesh.cell_size.prod());
    for (Eigen::Index p = 0; p < points.cols(); ++p) {
      const Eigen::Vector3d point = points.col(p), image(-point.x(), point.y(), point.z());
      EXPECT_LT((points.colwise() - image).colwise().norm().minCoeff(), 1e-9);
      for (Eigen::Index q = 0; q < p; ++q) EXPECT_GE((points.col(q) - point).norm(), 0.01 * spacing * (1 - 1e-12));
    }
    for (const auto vertex : body.skin.vertices.colwise())
      EXPECT_LT((points.colwise() - vertex).colwise().norm().minCoeff(), spacing);
  }
}

TEST(ContactPoints, StartWithTheSoles) {
  const Character body = two_legged(0.1);
  const ControlMesh mesh = build_control_mesh(body.skeleton, body.skin);
  const ContactPoints contact = contact_points(mesh, body.skeleton, body.skin);
  const double sole = body.skin.vertices.row(1).minCoeff();
  EXPECT_DOUBLE_EQ(body.skin.vertices(1, contact.vertices[0]), sole);
  for (const int bone : {2, 4}) {
    int on_the_sole = 0;
    for (Eigen::Index p = 0; p < contact.bones.size(); ++p)
      on_the_sole += contact.bones[p] == bone && body.skin.vertices(1, contact.vertices[p]) == sole;
    EXPECT_GE(on_the_sole, 4);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::embedding_test

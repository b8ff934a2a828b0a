#include "io/rig.h"

#include <gtest/gtest.h>

#include <random>

#include "io/scene_pose.h"
#include "retarget/error.h"

namespace hydrostat::io::rig_test {
namespace {

Eigen::Affine3d random_transform(std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  const auto draw = [&] { return number(random); };
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.translate(Eigen::Vector3d::NullaryExpr(draw));
  transform.rotate(Eigen::Quaterniond(Eigen::Vector4d::NullaryExpr(draw)).normalized());
  transform.scale(Eigen::Vector3d::Constant(1) + 0.3 * Eigen::Vector3d::NullaryExpr(draw));
  return transform;
}

enum class Binding { kOnePose, kRebased, kAtOdds };

/// A chain of four bones and two meshes of ten vertices. The second mesh is bound in the pose of the first, or in it moved
/// as a whole, or each bone elsewhere.
Scene random_scene(unsigned seed, Binding binding) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  Scene scene;
  scene.metres_per_unit = 0.01;
  scene.to_y_up << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  for (int b = 0; b < 4; ++b) {
    SceneNode node;
    node.name = "bone" + std::to_string(b);
    node.parent = b - 1;
    node.parts = {random_transform(random)};
    node.is_joint = true;
    scene.nodes.push_back(node);
  }
  std::vector<Eigen::Affine3d> offsets;
  for (int b = 0; b < 4; ++b) offsets.push_back(random_transform(random));
  const Eigen::Affine3d moved = random_transform(random);
  for (int m = 0; m < 2; ++m) {
    SceneMesh mesh;
    mesh.name = "mesh" + std::to_string(m);
    mesh.vertices = Eigen::Matrix3Xd::NullaryExpr(3, 10 - m, [&] { return number(random); });
    mesh.triangles.resize(3, 1);
    mesh.triangles << 0, 1, 2;
    for (int b = 0; b < 4; ++b) {
      SceneMesh::Joint joint;
      joint.node = b;
      joint.inverse_bind_matrix = offsets[static_cast<std::size_t>(b)];
      if (m == 1 && binding == Binding::kRebased) joint.inverse_bind_matrix = joint.inverse_bind_matrix * moved;
      if (m == 1 && binding == Binding::kAtOdds) joint.inverse_bind_matrix = random_transform(random);
      for (int v = 0; v < mesh.vertices.cols(); ++v) joint.weights.push_back({v, 1.5 + number(random)});  // sums are not 1
      mesh.joints.push_back(joint);
    }
    scene.meshes.push_back(mesh);
  }
  scene.clips = {{"rest", 1, {}}};
  return scene;
}

/// Where the file itself has the skinned vertices: sum of weight * node * inverse bind matrix * vertex, in ours.
Eigen::Matrix3Xd skinned_by_the_file(const Scene& scene) {
  const std::vector<Eigen::Affine3d> poses = node_poses(scene, nullptr, 0);
  Eigen::Matrix3Xd points(3, 0);
  for (const SceneMesh& mesh : scene.meshes) {
    Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
    Eigen::VectorXd total = Eigen::VectorXd::Zero(mesh.vertices.cols());
    for (const SceneMesh::Joint& joint : mesh.joints) {
      for (const SceneMesh::Weight& weight : joint.weights) {
        sum.col(weight.vertex) += weight.weight * (poses[static_cast<std::size_t>(joint.node)] * joint.inverse_bind_matrix *
                                                   mesh.vertices.col(weight.vertex));
        total[weight.vertex] += weight.weight;
      }
    }
    points.conservativeResize(Eigen::NoChange, points.cols() + sum.cols());
    points.rightCols(sum.cols()) = scene.metres_per_unit * scene.to_y_up * sum * total.cwiseInverse().asDiagonal();
  }
  return points;
}

TEST(BuildRig, SkinningIsExactHoweverTheMeshesWereBound) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const Binding binding : {Binding::kOnePose, Binding::kRebased, Binding::kAtOdds}) {
      const Scene scene = random_scene(seed, binding);
      const Rig rig = build_rig(scene, "file");
      const Eigen::Matrix3Xd found = skin_positions(rig.skeleton, rig.skin, bone_poses(rig, scene, scene.clips[0], 0));
      const Eigen::Matrix3Xd wanted = skinned_by_the_file(scene);
      ASSERT_EQ(found.cols(), wanted.cols());
      EXPECT_LT((found - wanted).cwiseAbs().maxCoeff(), 1e-11);  // [m]
      EXPECT_EQ(rig.skeleton.count() > 4, binding == Binding::kAtOdds);
      EXPECT_EQ(rig.warnings.empty(), binding != Binding::kAtOdds);
    }
  }
}

TEST(BuildRig, VerticesOfOnePlaceAreWeldedUnlessTheirWeightsDiffer) {
  Scene scene = random_scene(1, Binding::kOnePose);
  scene.meshes.pop_back();
  SceneMesh& mesh = scene.meshes[0];
  for (SceneMesh::Joint& joint : mesh.joints) {
    joint.weights[4].weight = joint.weights[3].weight;
    joint.weights[6].weight = joint.node == 0 ? 1 : 0;
  }
  mesh.vertices.col(4) = mesh.vertices.col(3);
  mesh.vertices.col(6) = mesh.vertices.col(3);
  mesh.triangles.resize(3, 3);
  mesh.triangles << 0, 3, 0,  //
      3, 4, 4,                //
      1, 2, 1;
  const Rig rig = build_rig(scene, "file");
  EXPECT_EQ(rig.skin.vertices.cols(), 9);
  EXPECT_EQ(rig.skin.triangles.cols(), 2);  // the one between welded vertices is gone
  EXPECT_EQ(rig.skin.triangles.col(0), rig.skin.triangles.col(1));
}

TEST(BuildRig, WeightlessBonesStandToTheirNeighboursAsAtRest) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Scene scene = random_scene(seed, Binding::kOnePose);
    for (SceneMesh& mesh : scene.meshes) mesh.joints.erase(mesh.joints.begin() + 2);
    scene.nodes[2].is_joint = false;
    const Rig rig = build_rig(scene, "file");
    ASSERT_EQ(rig.skeleton.count(), 4);
    EXPECT_FALSE(rig.skeleton.weighted[2]);
    const Eigen::Affine3d between = rig.skeleton.bind_pose[1].inverse() * rig.skeleton.bind_pose[2];
    EXPECT_LT((between.matrix() - scene.nodes[2].parts[0].matrix()).norm(), 1e-9);
  }
}

TEST(BuildRig, AMeshBelowABoneMovesWithIt) {
  Scene scene = random_scene(3, Binding::kOnePose);
  SceneNode plate;
  plate.name = "plate";
  plate.parent = 2;
  plate.parts = {Eigen::Affine3d(Eigen::Translation3d(0, 1, 0))};
  plate.holds_mesh = true;
  scene.nodes.push_back(plate);
  SceneMesh mesh;
  mesh.name = "plate";
  mesh.node = 4;
  mesh.vertices = Eigen::Matrix3d::Identity();
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  scene.meshes.push_back(mesh);
  const Rig rig = build_rig(scene, "file");
  const Eigen::Matrix3Xd found = skin_positions(rig.skeleton, rig.skin, bone_poses(rig, scene, scene.clips[0], 0));
  const Eigen::Matrix3Xd wanted = rig.to_ours * node_poses(scene, nullptr, 0)[4] * mesh.vertices;
  EXPECT_LT((found.rightCols(3) - wanted).norm(), 1e-12);
}

TEST(BuildRig, AClosedSkinFacesOutward) {
  Scene scene = random_scene(4, Binding::kOnePose);
  scene.meshes.pop_back();
  for (SceneMesh::Joint& joint : scene.meshes[0].joints) joint.inverse_bind_matrix.setIdentity();
  SceneMesh& mesh = scene.meshes[0];
  mesh.vertices.setZero();
  mesh.vertices.block(0, 1, 3, 3).setIdentity();
  mesh.vertices.rightCols(6).setConstant(2);  // loose points
  mesh.triangles.resize(3, 4);
  mesh.triangles << 0, 0, 0, 1,  //
      2, 3, 1, 2,                //
      1, 2, 3, 3;
  const Rig outward = build_rig(scene, "file");
  EXPECT_TRUE(outward.warnings.empty());
  scene.meshes[0].triangles.row(0).swap(scene.meshes[0].triangles.row(1));
  const Rig turned = build_rig(scene, "file");
  ASSERT_EQ(turned.warnings.size(), 1u);
  for (const Rig* rig : {&outward, &turned}) {
    double volume = 0;
    for (Eigen::Index t = 0; t < 4; ++t) {
      const Eigen::Vector3i corners = rig->skin.triangles.col(t);
      Eigen::Matrix3d sides;
      for (int c = 0; c < 3; ++c) sides.col(c) = rig->skin.vertices.col(corners[c]);
      volume += sides.determinant() / 6;
    }
    EXPECT_GT(volume, 0);
  }
}

TEST(BuildRig, ASingularInverseBindMatrixIsRefused) {
  Scene scene = random_scene(0, Binding::kOnePose);
  scene.meshes[0].joints[2].inverse_bind_matrix.linear().col(1).setZero();
  try {
    build_rig(scene, "file");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.where, "bone 'bone2'");
  }
}

}  // namespace
}  // namespace hydrostat::io::rig_test

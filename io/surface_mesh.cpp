#include "io/surface_mesh.h"

#include <array>
#include <map>
#include <vector>

#include "io/import_worker.h"
#include "io/scene_pose.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr double kWeld = 1e-7;  // of the mesh's longest extent [-]: vertices nearer than that are one

/// All vertices, each triangle with three of its own [m], 3 x 3 T.
Eigen::Matrix3Xd corners_of(const Scene& scene) {
  const std::vector<Eigen::Affine3d> poses = node_poses(scene, nullptr, 0);
  std::vector<Eigen::Vector3d> corners;
  for (const SceneMesh& mesh : scene.meshes) {
    const Eigen::Affine3d to_scene = poses[static_cast<std::size_t>(mesh.node)];
    const bool mirrors = to_scene.linear().determinant() < 0;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const int corner = mirrors && k > 0 ? 3 - k : k;
        corners.emplace_back(scene.metres_per_unit * (scene.to_y_up * (to_scene * mesh.vertices.col(mesh.triangles(corner, t)))));
      }
    }
  }
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(corners.size()));
  for (std::size_t c = 0; c < corners.size(); ++c) all.col(static_cast<Eigen::Index>(c)) = corners[c];
  return all;
}

double enclosed_volume(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles) {
  double sum = 0;
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    sum += vertices.col(triangles(0, t)).cross(vertices.col(triangles(1, t))).dot(vertices.col(triangles(2, t))) / 6;
  }
  return sum;
}

}  // namespace

physics::ClosedMeshOf<3> read_closed_mesh(const std::filesystem::path& file, std::vector<std::string>& warnings) {
  const Eigen::Matrix3Xd corners = corners_of(read_in_worker(file.string()));
  if (corners.cols() == 0) throw Error(file.string(), "", "holds no triangle", "Give a file with a closed mesh.");
  const double extent = (corners.rowwise().maxCoeff() - corners.rowwise().minCoeff()).maxCoeff();
  if (!(extent > 0)) throw Error(file.string(), "", "has no extent", "Give a file with a closed mesh.");
  std::map<std::array<long, 3>, int> number;
  std::vector<int> vertex_of;
  std::vector<Eigen::Vector3d> places;
  for (Eigen::Index c = 0; c < corners.cols(); ++c) {
    std::array<long, 3> key;
    for (std::size_t d = 0; d < 3; ++d) key[d] = std::lround(corners(static_cast<Eigen::Index>(d), c) / (kWeld * extent));
    const auto [entry, is_new] = number.try_emplace(key, static_cast<int>(places.size()));
    if (is_new) places.emplace_back(corners.col(c));
    vertex_of.push_back(entry->second);
  }
  Eigen::Matrix3Xd vertices(3, static_cast<Eigen::Index>(places.size()));
  for (std::size_t v = 0; v < places.size(); ++v) vertices.col(static_cast<Eigen::Index>(v)) = places[v];
  std::vector<Eigen::Vector3i> faces;
  for (std::size_t c = 0; c < vertex_of.size(); c += 3) {
    const Eigen::Vector3i face(vertex_of[c], vertex_of[c + 1], vertex_of[c + 2]);
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) faces.push_back(face);  // a needle that welding closed
  }
  Eigen::Matrix3Xi triangles(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f) triangles.col(static_cast<Eigen::Index>(f)) = faces[f];
  const std::string name = file.filename().string();
  if (const std::size_t needles = vertex_of.size() / 3 - faces.size(); needles > 0) {
    warnings.push_back("'" + name + "': " + std::to_string(needles) + " of " + std::to_string(vertex_of.size() / 3) +
                       " triangles are needles; they are left out.");
  }
  if (enclosed_volume(vertices, triangles) < 0) {
    triangles.row(1).swap(triangles.row(2));
    warnings.push_back("'" + name + "': its triangles look inward; they are turned.");
  }
  const std::string broken = physics::broken_mesh_rule<3>(vertices, triangles);
  if (!broken.empty()) {
    throw Error(file.string(), "mesh", broken, "Close its holes, take out faces without area and make all look outward, in the program that made it.");
  }
  return {vertices, triangles};
}

}  // namespace hydrostat::io

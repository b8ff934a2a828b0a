#include "io/appearance.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <unordered_map>

#include "io/rig.h"
#include "io/scene.h"

namespace hydrostat::io {
namespace {

/// The places in images of a material's maps, each once, in order.
std::vector<int> uv_sets_of(const Material& material) {
  std::vector<int> sets;
  for (const TextureMap* map : maps_of(material)) {
    if (map->image >= 0) sets.push_back(map->uv_set);
  }
  std::sort(sets.begin(), sets.end());
  sets.erase(std::unique(sets.begin(), sets.end()), sets.end());
  return sets;
}

/// One way to draw: triangles of one material whose vertices are told the same things.
struct PartKind {
  int material;
  bool has_normals, has_colours;
  auto operator<=>(const PartKind&) const = default;
};

/// A part while it grows.
class PartBuilder {
 public:
  PartBuilder(const PartKind& kind, std::vector<int> uv_sets, bool has_normal_map)
      : kind_(kind), uv_sets_(std::move(uv_sets)), has_normal_map_(has_normal_map && kind.has_normals) {}

  /// The drawn vertex of a vertex of the skin that a mesh tells of at its own place `v`.
  int vertex(int skin_vertex, const RigMesh& mesh, Eigen::Index v, bool mirrored) {
    std::vector<double> told;
    const auto tell = [&](const auto& column) { told.insert(told.end(), column.begin(), column.end()); };
    if (kind_.has_normals) tell(mesh.normals.col(v));
    for (const int set : uv_sets_) {
      if (static_cast<std::size_t>(set) < mesh.uvs.size() && mesh.uvs[static_cast<std::size_t>(set)].cols() > v) {
        tell(mesh.uvs[static_cast<std::size_t>(set)].col(v));
      } else {
        told.insert(told.end(), {0, 0});
      }
    }
    if (kind_.has_colours) tell(mesh.colours.col(v));
    // v's side is one for a whole triangle.
    std::string key(reinterpret_cast<const char*>(told.data()), told.size() * sizeof(double));
    key.append(reinterpret_cast<const char*>(&skin_vertex), sizeof skin_vertex);
    if (has_normal_map_ && mirrored) key += 'm';
    const auto [place, is_new] = drawn_.try_emplace(std::move(key), static_cast<int>(vertices_.size()));
    if (is_new) {
      vertices_.push_back(skin_vertex);
      told_.insert(told_.end(), told.begin(), told.end());
    }
    return place->second;
  }

  void triangle(const Eigen::Vector3i& corners) { triangles_.insert(triangles_.end(), corners.begin(), corners.end()); }
  bool has_normal_map() const { return has_normal_map_; }
  /// Which of the part's sets of places a normal map takes.
  Eigen::Index place_of_set(int set) const { return std::find(uv_sets_.begin(), uv_sets_.end(), set) - uv_sets_.begin(); }

  Appearance::Part finish() const {
    Appearance::Part part;
    const auto count = static_cast<Eigen::Index>(vertices_.size());
    part.material = kind_.material;
    part.vertices = Eigen::Map<const Eigen::VectorXi>(vertices_.data(), count);
    part.triangles =
        Eigen::Map<const Eigen::Matrix3Xi>(triangles_.data(), 3, static_cast<Eigen::Index>(triangles_.size() / 3));
    const Eigen::Map<const Eigen::MatrixXd> told(told_.data(),
                                                 count > 0 ? static_cast<Eigen::Index>(told_.size()) / count : 0, count);
    Eigen::Index row = 0;
    if (kind_.has_normals) part.normals = told.middleRows<3>(std::exchange(row, row + 3));
    for (std::size_t s = 0; s < uv_sets_.size(); ++s) part.uvs.emplace_back(told.middleRows<2>(std::exchange(row, row + 2)));
    if (kind_.has_colours) part.colours = told.middleRows<4>(row);
    return part;
  }

 private:
  const PartKind kind_;
  const std::vector<int> uv_sets_;
  const bool has_normal_map_;
  std::unordered_map<std::string, int> drawn_;
  std::vector<int> vertices_, triangles_;
  std::vector<double> told_;  // by vertex
};

/// How a triangle lies in an image: twice its area there, negative where it is mirrored.
double area_in_image(const Eigen::Matrix2Xd& uvs, const Eigen::Vector3i& corners) {
  const Eigen::Vector2d a = uvs.col(corners[1]) - uvs.col(corners[0]), b = uvs.col(corners[2]) - uvs.col(corners[0]);
  return a.x() * b.y() - a.y() * b.x();
}

/// Directions along u, made square to the normals; each triangle counts at a corner by its angle there.
/// Source: Lengyel, "Computing Tangent Space Basis Vectors for an Arbitrary Mesh", 2001.
Eigen::Matrix4Xd tangents_of(const Appearance::Part& part, const Eigen::Matrix2Xd& uvs, const Eigen::Matrix3Xd& skin) {
  Eigen::Matrix3Xd sums = Eigen::Matrix3Xd::Zero(3, part.vertices.size());
  Eigen::RowVectorXd sides = Eigen::RowVectorXd::Zero(part.vertices.size());
  for (const auto corners : part.triangles.colwise()) {
    Eigen::Matrix3d points;
    for (int k = 0; k < 3; ++k) points.col(k) = skin.col(part.vertices[corners[k]]);
    const double area = area_in_image(uvs, corners);
    if (area == 0) continue;
    const Eigen::Vector2d a = uvs.col(corners[1]) - uvs.col(corners[0]), b = uvs.col(corners[2]) - uvs.col(corners[0]);
    const Eigen::Vector3d along = ((points.col(1) - points.col(0)) * b.y() - (points.col(2) - points.col(0)) * a.y()) / area;
    if (!(along.norm() > 0)) continue;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d to_next = points.col((k + 1) % 3) - points.col(k),
                            to_last = points.col((k + 2) % 3) - points.col(k);
      const double angle = std::atan2(to_next.cross(to_last).norm(), to_next.dot(to_last));
      sums.col(corners[k]) += angle * along.normalized();
      sides[corners[k]] += area > 0 ? -angle : angle;  // v runs downward
    }
  }
  Eigen::Matrix4Xd tangents(4, part.vertices.size());
  for (Eigen::Index v = 0; v < tangents.cols(); ++v) {
    const Eigen::Vector3d normal = part.normals.col(v);
    Eigen::Vector3d along = sums.col(v) - normal.dot(sums.col(v)) * normal;
    if (!(along.norm() > 1e-9)) along = normal.unitOrthogonal();
    tangents.col(v) << along.normalized(), sides[v] < 0 ? -1 : 1;
  }
  return tangents;
}

bool is_told(const Rig& rig) {
  const bool has_material = rig.triangle_materials.size() > 0 && rig.triangle_materials.maxCoeff() >= 0;
  return has_material ||
         std::any_of(rig.meshes.begin(), rig.meshes.end(), [](const RigMesh& mesh) { return mesh.colours.size() > 0; });
}

/// Whether the normals that the meshes tell look to the side away from which their triangles are seen.
bool normals_look_inward(const Rig& rig, const std::vector<int>& mesh_of_triangle) {
  double sum = 0;
  for (Eigen::Index t = 0; t < rig.corners.cols(); ++t) {
    const RigMesh& mesh = rig.meshes[static_cast<std::size_t>(mesh_of_triangle[static_cast<std::size_t>(t)])];
    if (mesh.normals.size() == 0) continue;
    const Eigen::Vector3i corners = rig.skin.triangles.col(t);
    const Eigen::Vector3d a = rig.skin.vertices.col(corners[0]);
    const Eigen::Vector3d area = (rig.skin.vertices.col(corners[1]) - a).cross(rig.skin.vertices.col(corners[2]) - a);
    for (int k = 0; k < 3; ++k) sum += area.dot(mesh.normals.col(rig.corners(k, t) - mesh.first_vertex));
  }
  return sum < 0;
}

std::vector<int> meshes_of_triangles(const Rig& rig) {
  std::vector<int> meshes;
  for (Eigen::Index t = 0; t < rig.corners.cols(); ++t) {
    const auto behind = std::upper_bound(rig.meshes.begin(), rig.meshes.end(), rig.corners(0, t),
                                         [](int vertex, const RigMesh& mesh) { return vertex < mesh.first_vertex; });
    meshes.push_back(static_cast<int>(behind - rig.meshes.begin()) - 1);
  }
  return meshes;
}

/// Takes over the materials that the parts wear and the images that those show, and numbers them anew.
void keep_what_is_worn(const Scene& scene, Appearance& appearance) {
  std::map<int, int> material_now, image_now;
  for (Appearance::Part& part : appearance.parts) {
    if (part.material < 0) continue;
    const auto [place, is_new] = material_now.try_emplace(part.material, static_cast<int>(appearance.materials.size()));
    if (is_new) {
      Material material = scene.materials[static_cast<std::size_t>(part.material)];
      const std::vector<int> sets = uv_sets_of(material);
      for (TextureMap* map : maps_of(material)) {
        if (map->image < 0) continue;
        const auto [image, is_new_image] = image_now.try_emplace(map->image, static_cast<int>(appearance.images.size()));
        if (is_new_image) appearance.images.push_back(scene.images[static_cast<std::size_t>(map->image)]);
        map->image = image->second;
        map->uv_set = static_cast<int>(std::find(sets.begin(), sets.end(), map->uv_set) - sets.begin());
      }
      appearance.materials.push_back(std::move(material));
    }
    part.material = place->second;
  }
}

}  // namespace

Appearance build_appearance(const Scene& scene, const Rig& rig, const Eigen::Matrix3d& turn) {
  Appearance appearance;
  if (!is_told(rig)) return appearance;
  const std::vector<int> mesh_of_triangle = meshes_of_triangles(rig);
  const double side = normals_look_inward(rig, mesh_of_triangle) ? -1 : 1;
  std::map<PartKind, std::size_t> part_of_kind;
  std::vector<PartBuilder> builders;
  std::vector<int> normal_sets;
  for (Eigen::Index t = 0; t < rig.corners.cols(); ++t) {
    const RigMesh& mesh = rig.meshes[static_cast<std::size_t>(mesh_of_triangle[static_cast<std::size_t>(t)])];
    const PartKind kind{rig.triangle_materials[t], mesh.normals.size() > 0, mesh.colours.size() > 0};
    const auto [place, is_new] = part_of_kind.try_emplace(kind, builders.size());
    if (is_new) {
      const Material* material = kind.material < 0 ? nullptr : &scene.materials[static_cast<std::size_t>(kind.material)];
      builders.emplace_back(kind, material ? uv_sets_of(*material) : std::vector<int>{},
                            material && material->normal_map.image >= 0);
      normal_sets.push_back(material ? material->normal_map.uv_set : 0);
    }
    PartBuilder& builder = builders[place->second];
    const Eigen::Vector3i from = rig.corners.col(t).array() - mesh.first_vertex;
    const auto set = static_cast<std::size_t>(normal_sets[place->second]);
    const bool mirrored = builder.has_normal_map() && set < mesh.uvs.size() && mesh.uvs[set].size() > 0 &&
                          area_in_image(mesh.uvs[set], from) < 0;
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) corners[k] = builder.vertex(rig.skin.triangles(k, t), mesh, from[k], mirrored);
    builder.triangle(corners);
  }
  for (std::size_t p = 0; p < builders.size(); ++p) {
    Appearance::Part part = builders[p].finish();
    part.normals = side * part.normals;
    if (builders[p].has_normal_map()) {
      const auto set = static_cast<std::size_t>(builders[p].place_of_set(normal_sets[p]));
      part.tangents = tangents_of(part, part.uvs[set], rig.skin.vertices);
      part.tangents.topRows<3>() = turn * part.tangents.topRows<3>();
    }
    part.normals = turn * part.normals;
    appearance.parts.push_back(std::move(part));
  }
  keep_what_is_worn(scene, appearance);
  return appearance;
}

}  // namespace hydrostat::io

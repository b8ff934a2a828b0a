#include "io/rig_skin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace hydrostat::io {
namespace {

constexpr double kWeldGrid = 1e-6;    // relative to the skin's extent
constexpr double kWeightGrid = 1e-3;  // difference of skin weights that keeps vertices apart
constexpr double kNoWeight = 1e-6;    // sum of skin weights below which a vertex has none
constexpr std::size_t kMostCompared = 64;

/// Binds every vertex without weights to the nearest bone.
void bind_stray_vertices(Rig& rig) {
  int strays = 0;
  for (Eigen::Index v = 0; v < rig.skin.vertices.cols(); ++v) {
    std::vector<retarget::SkinnedMesh::Influence>& influences = rig.skin.skin_weights[static_cast<std::size_t>(v)];
    if (!influences.empty()) continue;
    influences.push_back({nearest_bone(rig.skeleton, rig.skin.vertices.col(v)), 1});
    ++strays;
  }
  if (strays > 0)
    rig.warnings.push_back(std::to_string(strays) + " vertices have no skin weights; each goes with the nearest bone.");
}

/// Both lists are sorted by bone.
bool weights_agree(const std::vector<retarget::SkinnedMesh::Influence>& a,
                   const std::vector<retarget::SkinnedMesh::Influence>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](const auto& x, const auto& y) {
           return x.bone == y.bone && std::abs(x.weight - y.weight) < kWeightGrid;
         });
}

/// How the morph targets move each vertex: which of them, and its offset [m].
class MorphsOfVertices {
 public:
  explicit MorphsOfVertices(const retarget::SkinnedMesh& skin) {
    if (skin.morphs.empty()) return;
    moves_.resize(static_cast<std::size_t>(skin.vertices.cols()));
    for (std::size_t k = 0; k < skin.morphs.size(); ++k) {
      const retarget::MorphTarget& morph = skin.morphs[k];
      for (Eigen::Index i = 0; i < morph.vertices.size(); ++i)
        moves_[static_cast<std::size_t>(morph.vertices[i])].push_back({k, morph.offsets.col(i)});
    }
  }

  bool agree(int a, int b, double tolerance) const {
    if (moves_.empty()) return true;
    const std::vector<Move>&x = moves_[static_cast<std::size_t>(a)], &y = moves_[static_cast<std::size_t>(b)];
    return x.size() == y.size() && std::equal(x.begin(), x.end(), y.begin(), [&](const Move& p, const Move& q) {
             return p.morph == q.morph && (p.offset - q.offset).cwiseAbs().maxCoeff() <= tolerance;
           });
  }

 private:
  struct Move {
    std::size_t morph;
    Eigen::Vector3d offset;
  };
  std::vector<std::vector<Move>> moves_;
};

/// Names the vertices of the morph targets anew, each once.
void renumber_morphs(const std::vector<int>& now, std::vector<retarget::MorphTarget>& morphs) {
  for (retarget::MorphTarget& morph : morphs) {
    std::map<int, Eigen::Index> kept;
    for (Eigen::Index i = 0; i < morph.vertices.size(); ++i)
      kept.try_emplace(now[static_cast<std::size_t>(morph.vertices[i])], i);
    const auto count = static_cast<Eigen::Index>(kept.size());
    retarget::MorphTarget renumbered{morph.name, Eigen::VectorXi(count), Eigen::Matrix3Xd(3, count)};
    Eigen::Index place = 0;
    for (const auto& [vertex, from] : kept) {
      renumbered.vertices[place] = vertex;
      renumbered.offsets.col(place++) = morph.offsets.col(from);
    }
    morph = std::move(renumbered);
  }
}

/// Makes one vertex of those that share place, weights and morphs (seams of texture and normals, but not the lips of a
/// closed mouth), and drops triangles that collapse.
void weld(Rig& rig) {
  retarget::SkinnedMesh& skin = rig.skin;
  const double grid = kWeldGrid * std::max(extent_of(skin.vertices), 1e-12);
  using Place = std::array<long long, 3>;
  std::map<Place, std::vector<int>> welded_at;
  std::vector<int> now(static_cast<std::size_t>(skin.vertices.cols())), first_of;
  const MorphsOfVertices morphs(skin);
  retarget::SkinnedMesh welded;
  welded.vertices.resize(3, skin.vertices.cols());
  for (Eigen::Index v = 0; v < skin.vertices.cols(); ++v) {
    const auto& weights = skin.skin_weights[static_cast<std::size_t>(v)];
    Place place;
    for (int axis = 0; axis < 3; ++axis) place[static_cast<std::size_t>(axis)] = std::llround(skin.vertices(axis, v) / grid);
    std::vector<int>& here = welded_at[place];
    // Where a hostile file heaps up vertices of all weights, the first few are compared.
    const auto end = here.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(here.size(), kMostCompared));
    const auto same = std::find_if(here.begin(), end, [&](int other) {
      return weights_agree(weights, welded.skin_weights[static_cast<std::size_t>(other)]) &&
             morphs.agree(static_cast<int>(v), first_of[static_cast<std::size_t>(other)], grid);
    });
    if (same == end) {
      here.push_back(static_cast<int>(welded.skin_weights.size()));
      welded.vertices.col(here.back()) = skin.vertices.col(v);
      welded.skin_weights.push_back(weights);
      first_of.push_back(static_cast<int>(v));
      now[static_cast<std::size_t>(v)] = here.back();
    } else {
      now[static_cast<std::size_t>(v)] = *same;
    }
  }
  welded.vertices.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(welded.skin_weights.size()));
  welded.triangles.resize(3, skin.triangles.cols());
  rig.corners.resize(3, skin.triangles.cols());
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < skin.triangles.cols(); ++t) {
    const Eigen::Vector3i corners = skin.triangles.col(t).unaryExpr([&](int v) { return now[static_cast<std::size_t>(v)]; });
    const bool flat = corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
    if (flat) continue;
    rig.corners.col(kept) = skin.triangles.col(t);
    rig.triangle_materials[kept] = rig.triangle_materials[t];
    welded.triangles.col(kept++) = corners;
  }
  welded.triangles.conservativeResize(Eigen::NoChange, kept);
  rig.corners.conservativeResize(Eigen::NoChange, kept);
  rig.triangle_materials.conservativeResize(kept);
  welded.morphs = std::move(skin.morphs);
  renumber_morphs(now, welded.morphs);
  skin = std::move(welded);
}

/// Turns the triangles of a closed skin round where they face inward.
void face_outward(Rig& rig) {
  retarget::SkinnedMesh& skin = rig.skin;
  std::set<std::pair<int, int>> edges;
  double volume = 0;
  for (Eigen::Index t = 0; t < skin.triangles.cols(); ++t) {
    const Eigen::Vector3i corners = skin.triangles.col(t);
    for (int c = 0; c < 3; ++c) edges.emplace(corners[c], corners[(c + 1) % 3]);
    const Eigen::Vector3d a = skin.vertices.col(corners[0]), b = skin.vertices.col(corners[1]),
                          c = skin.vertices.col(corners[2]);
    volume += a.dot(b.cross(c)) / 6;
  }
  const bool closed = std::all_of(edges.begin(), edges.end(), [&](const std::pair<int, int>& edge) {
    return edges.contains({edge.second, edge.first});
  });
  if (!closed || volume >= 0) return;
  skin.triangles.row(1).swap(skin.triangles.row(2));
  rig.corners.row(1).swap(rig.corners.row(2));
  rig.warnings.push_back("The skin's triangles face inward; they are turned round.");
}

/// What a mesh tells of its looks; `linear` takes mesh space to the common bind space.
void add_looks(const SceneMesh& mesh, const Eigen::Matrix3d& linear, int first_vertex, Eigen::Index first_triangle,
               Rig& rig) {
  RigMesh looks{first_vertex, {}, mesh.uvs, mesh.colours};
  if (mesh.normals.size() > 0) {
    // Normals go by the inverse transposed; the adjugate is that but for a factor, and does without a division.
    Eigen::Matrix3d turned;
    for (int k = 0; k < 3; ++k) turned.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
    turned = (linear.determinant() < 0 ? -1 : 1) * rig.to_ours.linear() * turned;
    looks.normals = turned * mesh.normals;
    for (auto normal : looks.normals.colwise()) {
      if (!(normal.norm() > 0)) normal = Eigen::Vector3d::UnitY();
      normal.normalize();
    }
  }
  rig.meshes.push_back(std::move(looks));
  rig.triangle_materials.conservativeResize(first_triangle + mesh.triangles.cols());
  auto materials = rig.triangle_materials.tail(mesh.triangles.cols());
  materials.setConstant(-1);
  if (mesh.triangle_materials.size() == materials.size()) materials = mesh.triangle_materials;
}

/// The morph of the skin that takes what a mesh tells of one; a name that is there already gets a number.
retarget::MorphTarget& morph_of(const Rig::MorphSource& source, const std::string& name, Rig& rig) {
  std::vector<retarget::MorphTarget>& morphs = rig.skin.morphs;
  for (std::size_t k = 0; k < morphs.size(); ++k) {
    if (rig.morph_sources[k].node == source.node && rig.morph_sources[k].target == source.target) return morphs[k];
  }
  const bool is_taken = std::any_of(morphs.begin(), morphs.end(), [&](const auto& morph) { return morph.name == name; });
  rig.morph_sources.push_back(source);
  const std::string number = is_taken ? "#" + std::to_string(rig.morph_sources.size()) : "";
  return morphs.emplace_back(retarget::MorphTarget{name + number, {}, {}});
}

void add_morphs(const SceneMesh& mesh, const Eigen::Matrix3d& linear, int first_vertex, Rig& rig) {
  for (std::size_t t = 0; t < mesh.morphs.size(); ++t) {
    const SceneMesh::Morph& told = mesh.morphs[t];
    if (told.vertices.size() == 0) continue;
    retarget::MorphTarget& morph = morph_of({mesh.node, static_cast<int>(t), told.weight}, told.name, rig);
    const Eigen::Index before = morph.vertices.size(), more = told.vertices.size();
    morph.vertices.conservativeResize(before + more);
    morph.vertices.tail(more) = told.vertices.array() + first_vertex;
    morph.offsets.conservativeResize(Eigen::NoChange, before + more);
    morph.offsets.rightCols(more) = rig.to_ours.linear() * linear * told.offsets;
  }
}

}  // namespace

int nearest_bone(const retarget::Skeleton& skeleton, const Eigen::Vector3d& point) {
  double least = std::numeric_limits<double>::infinity();
  int nearest = -1;
  const auto consider = [&](int bone, double distance) {
    if (distance >= least || !skeleton.weighted[static_cast<std::size_t>(bone)]) return;
    least = distance;
    nearest = bone;
  };
  for (int b = 0; b < skeleton.count(); ++b) {
    const Eigen::Vector3d end = skeleton.bind_pose[static_cast<std::size_t>(b)].translation();
    consider(b, (point - end).norm());
    const int parent = skeleton.parents[static_cast<std::size_t>(b)];
    if (parent < 0) continue;
    const Eigen::Vector3d start = skeleton.bind_pose[static_cast<std::size_t>(parent)].translation();
    const double along = (point - start).dot(end - start) / std::max((end - start).squaredNorm(), 1e-300);
    consider(parent, (point - start - std::clamp(along, 0.0, 1.0) * (end - start)).norm());
  }
  return nearest;
}

double extent_of(const Eigen::Matrix3Xd& points) {
  return (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).maxCoeff();
}

void add_mesh(const SceneMesh& mesh, const Eigen::Affine3d& into_bind, const std::vector<int>& bones, Rig& rig) {
  retarget::SkinnedMesh& skin = rig.skin;
  const Eigen::Index first = skin.vertices.cols(), first_triangle = skin.triangles.cols();
  skin.vertices.conservativeResize(Eigen::NoChange, first + mesh.vertices.cols());
  skin.vertices.rightCols(mesh.vertices.cols()) = rig.to_ours * into_bind * mesh.vertices;
  skin.triangles.conservativeResize(Eigen::NoChange, first_triangle + mesh.triangles.cols());
  skin.triangles.rightCols(mesh.triangles.cols()) = mesh.triangles.array() + static_cast<int>(first);
  if (into_bind.linear().determinant() < 0) {
    skin.triangles.rightCols(mesh.triangles.cols()).row(1).swap(skin.triangles.rightCols(mesh.triangles.cols()).row(2));
  }
  add_morphs(mesh, into_bind.linear(), static_cast<int>(first), rig);
  add_looks(mesh, into_bind.linear(), static_cast<int>(first), first_triangle, rig);
  std::vector<std::map<int, double>> sums(static_cast<std::size_t>(mesh.vertices.cols()));
  for (std::size_t j = 0; j < mesh.joints.size(); ++j) {
    for (const SceneMesh::Weight& weight : mesh.joints[j].weights) {
      sums[static_cast<std::size_t>(weight.vertex)][bones[j]] += weight.weight;
    }
  }
  for (const std::map<int, double>& weights : sums) {
    double total = 0;
    for (const auto& [bone, weight] : weights) total += weight;
    std::vector<retarget::SkinnedMesh::Influence> influences;
    for (const auto& [bone, weight] : weights) {
      if (total > kNoWeight && weight > 0) influences.push_back({bone, weight / total});
    }
    skin.skin_weights.push_back(std::move(influences));
  }
}

void finish_skin(Rig& rig) {
  bind_stray_vertices(rig);
  weld(rig);
  face_outward(rig);
}

}  // namespace hydrostat::io

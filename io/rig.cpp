#include "io/rig.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "io/rig_skin.h"
#include "io/scene_pose.h"
#include "io/track.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr double kSameBind = 1e-4;  // distance at which two bind poses are one, relative to the mesh's extent

bool is_singular(const Eigen::Affine3d& transform) {
  const double size = transform.linear().norm();
  return !(std::abs(transform.linear().determinant()) > 1e-12 * size * size * size);
}

/// Largest distance between what two transforms make of the corners of a mesh's box.
double difference(const Eigen::Affine3d& a, const Eigen::Affine3d& b, const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  double largest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d at(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                             corner & 4 ? high.z() : low.z());
    largest = std::max(largest, (a * at - b * at).norm());
  }
  return largest;
}

double total_weight(const SceneMesh::Joint& joint) {
  double sum = 0;
  for (const SceneMesh::Weight& weight : joint.weights) sum += weight.weight;
  return sum;
}

bool is_skinned(const SceneMesh& mesh) {
  return std::any_of(mesh.joints.begin(), mesh.joints.end(),
                     [](const SceneMesh::Joint& joint) { return !joint.weights.empty(); });
}

class RigBuilder {
 public:
  RigBuilder(const Scene& scene, const std::string& path)
      : scene_(scene),
        path_(path),
        rest_(node_poses(scene, nullptr, 0)),
        bind_(scene.nodes.size()),
        bone_of_(scene.nodes.size(), -1) {
    moved_.assign(scene.nodes.size(), false);
    weighted_.assign(scene.nodes.size(), false);
    for (const SceneClip& clip : scene.clips) {
      for (const Channel& channel : clip.channels) moved_[static_cast<std::size_t>(channel.node)] = true;
    }
  }

  Rig build() {
    rig_.to_ours = Eigen::Affine3d(scene_.metres_per_unit * scene_.to_y_up);
    for (const SceneMesh& mesh : scene_.meshes) {
      if (is_skinned(mesh)) skinned_.push_back(&mesh);
    }
    if (!skinned_.empty() || moves_as_parts()) bind_meshes();
    if (skinned_.empty()) require_skeleton_alone();
    add_bones();
    for (std::size_t m = 0; m < skinned_.size(); ++m) {
      std::vector<int> bones;
      for (const Bound& bound : bound_[m]) bones.push_back(bound.bone);
      add_mesh(*skinned_[m], into_bind_[m], bones, rig_);
    }
    if (!skinned_.empty()) finish_skin(rig_);
    return std::move(rig_);
  }

 private:
  /// A mesh's joint, how it was bound.
  struct Bound {
    bool twin = false;     // its bind pose does not fit the bone's
    Eigen::Affine3d bind;  // bone space to the common bind space, file units
    int bone = -1;
  };

  void require_skeleton_alone() const {
    const bool moved =
        std::any_of(scene_.clips.begin(), scene_.clips.end(), [](const SceneClip& clip) { return !clip.channels.empty(); });
    if (scene_.meshes.empty() && moved) return;
    throw Error(path_, "skeleton", "no mesh is bound to a skeleton",
                "Bind the mesh to bones and export it with its skin and its clip");
  }

  /// Whether some clip moves several nodes with meshes at once, as the parts of a jointed toy; a thing that flies about for
  /// itself is no character.
  bool moves_as_parts() const {
    std::vector<bool> carries(scene_.nodes.size(), false);
    for (const SceneMesh& mesh : scene_.meshes) {
      int carrier = mesh.node;
      while (!moved_[static_cast<std::size_t>(carrier)] && node(carrier).parent >= 0) carrier = node(carrier).parent;
      carries[static_cast<std::size_t>(carrier)] = true;
    }
    return std::any_of(scene_.clips.begin(), scene_.clips.end(), [&](const SceneClip& clip) {
      std::set<int> parts;
      for (const Channel& channel : clip.channels) {
        if (carries[static_cast<std::size_t>(channel.node)]) parts.insert(channel.node);
      }
      return parts.size() >= 2;
    });
  }

  /// Finds one bind pose for the bones of all meshes, and what takes each mesh into it. The skinned mesh of most vertices
  /// leads.
  void bind_meshes() {
    std::stable_sort(skinned_.begin(), skinned_.end(),
                     [](const SceneMesh* a, const SceneMesh* b) { return a->vertices.cols() > b->vertices.cols(); });
    for (const SceneMesh* mesh : skinned_) {
      for (const SceneMesh::Joint& joint : mesh->joints) {
        if (joint.weights.empty() || !is_singular(joint.inverse_bind_matrix)) continue;
        throw Error(path_, "bone '" + name_of(joint.node) + "'", "its inverse bind matrix is singular",
                    "Give the bone a scale other than 0 in the bind pose");
      }
      bind_mesh(*mesh);
    }
    for (std::size_t m = 0; m < skinned_.size(); ++m) bind_weightless_joints(*skinned_[m], into_bind_[m]);
    find_rigid_parts();
    for (const SceneMesh& part : rigid_parts_) {
      skinned_.push_back(&part);
      into_bind_.push_back(part.joints.empty()
                               ? stand_in_bind_space(part.node)
                               : stand_in_bind_space(part.joints.front().node) * part.joints.front().inverse_bind_matrix);
      bound_.push_back(bind_joints(part, into_bind_.back()));
    }
  }

  void bind_mesh(const SceneMesh& mesh) {
    into_bind_.push_back(into_bind_space(mesh));
    bound_.push_back(bind_joints(mesh, into_bind_.back()));
  }

  /// Meshes without a skin that hang below a bone (a robot's plates) belong to the body: each goes whole with the nearest
  /// node above it that moves by itself. Other meshes (a static double, the floor) stay out.
  void find_rigid_parts() {
    std::string left_out;
    int count = 0;
    for (const SceneMesh& mesh : scene_.meshes) {
      if (is_skinned(mesh)) continue;
      int carrier = mesh.node;
      while (!moved_[static_cast<std::size_t>(carrier)] && !node(carrier).is_joint && node(carrier).parent >= 0)
        carrier = node(carrier).parent;
      const bool carried = hangs_below_joint(mesh.node) || moved_[static_cast<std::size_t>(carrier)];
      const bool flat =
          is_singular(rest_[static_cast<std::size_t>(carrier)]) || is_singular(rest_[static_cast<std::size_t>(mesh.node)]);
      if (mesh.is_wanted && !carried && !skinned_.empty()) {
        rigid_parts_.push_back(hung_on_nearest_bones(mesh));
        rig_.warnings.push_back("Mesh '" + mesh.name + "' hangs on nothing; its vertices go with the nearest bones.");
        continue;
      }
      if (!carried || flat) {
        left_out += (count++ == 0 ? "'" : ", '") + mesh.name + "'";
        continue;
      }
      SceneMesh part = mesh;
      SceneMesh::Joint joint;
      joint.node = carrier;
      joint.inverse_bind_matrix =
          rest_[static_cast<std::size_t>(carrier)].inverse() * rest_[static_cast<std::size_t>(mesh.node)];
      for (int v = 0; v < mesh.vertices.cols(); ++v) joint.weights.push_back({v, 1});
      part.joints = {joint};
      rigid_parts_.push_back(std::move(part));
    }
    if (count == 0) return;
    rig_.warnings.push_back(std::to_string(count) + " of " + std::to_string(scene_.meshes.size()) +
                            " meshes are not bound to bones, nor hang on any that moves, and are left out: " + left_out +
                            ". Bind them, or name them with --mesh.");
  }

  /// The mesh, each of its vertices on the weighted bone that is nearest to where both stand at rest.
  SceneMesh hung_on_nearest_bones(const SceneMesh& mesh) const {
    retarget::Skeleton standing;
    std::vector<int> place(scene_.nodes.size(), -1), nodes;
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n) {
      if (!weighted_[n] || is_singular(rest_[n])) continue;
      int parent = scene_.nodes[n].parent;
      while (parent >= 0 && place[static_cast<std::size_t>(parent)] < 0) parent = node(parent).parent;
      place[n] = standing.count();
      standing.names.push_back(scene_.nodes[n].name);
      standing.parents.push_back(parent < 0 ? -1 : place[static_cast<std::size_t>(parent)]);
      standing.bind_pose.push_back(rest_[n]);
      standing.weighted.push_back(true);
      nodes.push_back(static_cast<int>(n));
    }
    SceneMesh hung = mesh;
    std::map<int, SceneMesh::Joint> joints;
    const Eigen::Affine3d& rest = rest_[static_cast<std::size_t>(mesh.node)];
    for (int v = 0; v < mesh.vertices.cols(); ++v) {
      const int bone = nearest_bone(standing, rest * mesh.vertices.col(v));
      if (bone >= 0) joints[bone].weights.push_back({v, 1});
    }
    for (auto& [bone, joint] : joints) {
      joint.node = nodes[static_cast<std::size_t>(bone)];
      joint.inverse_bind_matrix = rest_[static_cast<std::size_t>(joint.node)].inverse() * rest;
      hung.joints.push_back(std::move(joint));
    }
    return hung;
  }

  bool hangs_below_joint(int n) const {
    while (n >= 0 && !node(n).is_joint) n = node(n).parent;
    return n >= 0;
  }

  const SceneNode& node(int index) const { return scene_.nodes[static_cast<std::size_t>(index)]; }

  /// What takes the mesh's space to the common bind space, by the heaviest joint whose bind pose is known.
  Eigen::Affine3d into_bind_space(const SceneMesh& mesh) const {
    std::vector<const SceneMesh::Joint*> joints;
    for (const SceneMesh::Joint& joint : mesh.joints) {
      if (!joint.weights.empty()) joints.push_back(&joint);
    }
    std::stable_sort(joints.begin(), joints.end(), [](const SceneMesh::Joint* a, const SceneMesh::Joint* b) {
      return total_weight(*a) > total_weight(*b);
    });
    for (const SceneMesh::Joint* joint : joints) {
      const std::optional<Eigen::Affine3d>& bind = bind_[static_cast<std::size_t>(joint->node)];
      if (bind) return *bind * joint->inverse_bind_matrix;
    }
    const std::optional<Eigen::Affine3d> beside = bind_beside(joints.front()->node);
    return beside ? *beside * joints.front()->inverse_bind_matrix : Eigen::Affine3d::Identity();
  }

  /// Where a node that is no bone of any skin stands in the bind pose: to its nearest bound relative, or else to the
  /// first bone of weight, as at rest.
  Eigen::Affine3d stand_in_bind_space(int node) const {
    if (bind_[static_cast<std::size_t>(node)]) return *bind_[static_cast<std::size_t>(node)];
    if (const std::optional<Eigen::Affine3d> beside = bind_beside(node)) return *beside;
    for (std::size_t n = 0; n < bind_.size(); ++n) {
      if (bind_[n] && weighted_[n] && !is_singular(rest_[n]))
        return *bind_[n] * rest_[n].inverse() * rest_[static_cast<std::size_t>(node)];
    }
    return rest_[static_cast<std::size_t>(node)];
  }

  std::vector<Bound> bind_joints(const SceneMesh& mesh, const Eigen::Affine3d& into_bind) {
    std::vector<Bound> bound(mesh.joints.size());
    const double tolerance = kSameBind * extent_of(into_bind * mesh.vertices);
    for (std::size_t j = 0; j < mesh.joints.size(); ++j) {
      const SceneMesh::Joint& joint = mesh.joints[j];
      if (joint.weights.empty()) continue;
      bound[j].bind = into_bind * joint.inverse_bind_matrix.inverse();
      std::optional<Eigen::Affine3d>& bind = bind_[static_cast<std::size_t>(joint.node)];
      if (!bind) bind = bound[j].bind;
      bound[j].twin = difference(*bind * joint.inverse_bind_matrix, into_bind, mesh.vertices) > tolerance;
      weighted_[static_cast<std::size_t>(joint.node)] = true;
    }
    return bound;
  }

  void bind_weightless_joints(const SceneMesh& mesh, const Eigen::Affine3d& into_bind) {
    for (const SceneMesh::Joint& joint : mesh.joints) {
      std::optional<Eigen::Affine3d>& bind = bind_[static_cast<std::size_t>(joint.node)];
      if (!bind && !is_singular(joint.inverse_bind_matrix)) bind = into_bind * joint.inverse_bind_matrix.inverse();
    }
  }

  /// The bind pose of a node that has none: it stands to the nearest bound ancestor, or else descendant, as it does at rest.
  std::optional<Eigen::Affine3d> bind_beside(int node) const {
    for (int up = node; up >= 0; up = scene_.nodes[static_cast<std::size_t>(up)].parent) {
      if (bind_[static_cast<std::size_t>(up)]) return stand_beside(up, node);
    }
    for (int down = node + 1; down < static_cast<int>(scene_.nodes.size()); ++down) {
      if (bind_[static_cast<std::size_t>(down)] && is_below(down, node)) return stand_beside(down, node);
    }
    return std::nullopt;
  }

  Eigen::Affine3d stand_beside(int bound, int node) const {
    const Eigen::Affine3d& from = rest_[static_cast<std::size_t>(bound)];
    const Eigen::Affine3d& bind = *bind_[static_cast<std::size_t>(bound)];
    if (is_singular(from)) return bind;  // scaled to nothing at rest: no place beside it can be told
    return bind * from.inverse() * rest_[static_cast<std::size_t>(node)];
  }

  bool is_below(int node, int ancestor) const {
    while (node > ancestor) node = scene_.nodes[static_cast<std::size_t>(node)].parent;
    return node == ancestor;
  }

  const std::string& name_of(int node) const { return scene_.nodes[static_cast<std::size_t>(node)].name; }

  /// Which scene nodes are bones.
  std::vector<bool> bones() const {
    const std::size_t count = scene_.nodes.size();
    std::vector<bool> leads(count, false), hangs(count, false), chosen(count, false);
    const auto is_named = [&](std::size_t n) {
      return skinned_.empty() ? static_cast<bool>(moved_[n]) : scene_.nodes[n].is_joint;
    };
    for (std::size_t n = count; n-- > 0;) {  // what leads down to a named bone
      const int parent = scene_.nodes[n].parent;
      if (parent >= 0 && (is_named(n) || leads[n])) leads[static_cast<std::size_t>(parent)] = true;
    }
    for (std::size_t n = 0; n < count; ++n) {
      const SceneNode& here = scene_.nodes[n];
      const std::size_t parent = static_cast<std::size_t>(std::max(here.parent, 0));
      const bool below_bone = here.parent >= 0 && chosen[parent];
      const bool below_weights = here.parent >= 0 && hangs[parent];
      hangs[n] = (skinned_.empty() ? is_named(n) : weighted_[n]) || (below_weights && !here.holds_mesh);
      chosen[n] = is_named(n) || hangs[n] || (leads[n] && (moved_[n] || below_bone));
    }
    return chosen;
  }

  void add_bones() {
    const std::vector<bool> chosen = bones();
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      if (!chosen[n]) continue;
      int parent = scene_.nodes[n].parent;
      while (parent >= 0 && bone_of_[static_cast<std::size_t>(parent)] < 0)
        parent = scene_.nodes[static_cast<std::size_t>(parent)].parent;
      const Eigen::Affine3d bind = skinned_.empty() ? rest_[n]
                                   : bind_[n]       ? *bind_[n]
                                                    : bind_beside(static_cast<int>(n)).value_or(rest_[n]);
      bone_of_[n] = add_bone(static_cast<int>(n), parent < 0 ? -1 : bone_of_[static_cast<std::size_t>(parent)], bind,
                             !skinned_.empty() && weighted_[n]);
    }
    int twins = 0;
    for (std::size_t m = 0; m < bound_.size(); ++m) {
      for (std::size_t j = 0; j < bound_[m].size(); ++j) {
        Bound& bound = bound_[m][j];
        const int node = skinned_[m]->joints[j].node;
        bound.bone = bone_of_[static_cast<std::size_t>(node)];
        if (!bound.twin) continue;
        bound.bone = add_bone(node, bound.bone, bound.bind, true);
        ++twins;
      }
    }
    if (twins > 0) {
      rig_.warnings.push_back("Meshes were bound in poses that do not fit together: " + std::to_string(twins) +
                              " bones have a twin of another bind pose.");
    }
  }

  int add_bone(int node, int parent, const Eigen::Affine3d& bind, bool weighted) {
    std::string name = name_of(node);
    const int uses = ++uses_of_name_[name];
    if (uses > 1) name.append(1, '#').append(std::to_string(uses));
    rig_.skeleton.names.push_back(name);
    rig_.skeleton.parents.push_back(parent);
    rig_.skeleton.bind_pose.push_back(rig_.to_ours * bind);
    rig_.skeleton.weighted.push_back(weighted);
    rig_.scene_nodes.push_back(node);
    return rig_.skeleton.count() - 1;
  }

  const Scene& scene_;
  const std::string& path_;
  const std::vector<Eigen::Affine3d> rest_;           // of every scene node
  std::vector<std::optional<Eigen::Affine3d>> bind_;  // of every scene node, bone space to the common bind space, file units
  std::vector<bool> moved_;                           // of every scene node: some clip has keys for it
  std::vector<bool> weighted_;                        // of every scene node
  std::vector<int> bone_of_;                          // of every scene node; -1 is none
  std::vector<const SceneMesh*> skinned_;             // rigid parts come last
  std::vector<SceneMesh> rigid_parts_;
  std::vector<Eigen::Affine3d> into_bind_;  // of every skinned mesh
  std::vector<std::vector<Bound>> bound_;   // of every skinned mesh, its joints
  std::map<std::string, int> uses_of_name_;
  Rig rig_;
};

}  // namespace

Rig build_rig(const Scene& scene, const std::string& path) { return RigBuilder(scene, path).build(); }

std::vector<Eigen::Affine3d> bone_poses(const Rig& rig, const Scene& scene, const SceneClip& clip, double time_s) {
  const std::vector<Eigen::Affine3d> nodes = node_poses(scene, &clip, time_s);
  std::vector<Eigen::Affine3d> poses;
  for (const int node : rig.scene_nodes) poses.push_back(rig.to_ours * nodes[static_cast<std::size_t>(node)]);
  return poses;
}

Eigen::VectorXd morph_weights(const Rig& rig, const SceneClip& clip, double time_s) {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rig.morph_sources.size()));
  std::map<std::pair<int, int>, const Track*> tracks;
  for (const MorphChannel& channel : clip.morphs) tracks[{channel.node, channel.target}] = &channel.weight;
  for (Eigen::Index k = 0; k < weights.size(); ++k) {
    const Rig::MorphSource& source = rig.morph_sources[static_cast<std::size_t>(k)];
    const auto track = tracks.find({source.node, source.target});
    if (track != tracks.end()) weights[k] = value_at(*track->second, time_s)[0] - source.at_rest;
  }
  return weights;
}

}  // namespace hydrostat::io

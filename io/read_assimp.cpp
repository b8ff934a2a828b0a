#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>

#include "io/assimp_materials.h"
#include "io/cut_polygons.h"
#include "io/lost_curves.h"
#include "io/read_scene.h"
#include "io/scene_morphs.h"
#include "io/track.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr std::string_view kPivotMark = "_$AssimpFbx$_";
constexpr double kDefaultTicksPerSecond = 25;
constexpr double kLongestFrame = 1.0 / 24;  // [s]; a tick is a second where assimp does not know the rate

Eigen::Affine3d to_eigen(const aiMatrix4x4& matrix) {
  Eigen::Affine3d ours = Eigen::Affine3d::Identity();
  for (unsigned row = 0; row < 3; ++row) {
    for (unsigned column = 0; column < 4; ++column) ours(row, column) = matrix[row][column];
  }
  return ours;
}

Eigen::Vector3d to_eigen(const aiVector3D& vector) { return {vector.x, vector.y, vector.z}; }

/// "Rotation" of "Hips_$AssimpFbx$_Rotation"; empty for a node that the file itself has.
std::string_view pivot_of(std::string_view name) {
  const std::size_t mark = name.find(kPivotMark);
  return mark == std::string_view::npos ? std::string_view{} : name.substr(mark + kPivotMark.size());
}

std::string format_of(const std::string& path) {
  const auto ends_in = [&](char letter) { return std::tolower(static_cast<unsigned char>(path.back())) == letter; };
  return ends_in('x') ? "fbx" : ends_in('e') ? "collada" : ends_in('j') ? "obj" : ends_in('l') ? "stl" : "bvh";
}

void set_up(Assimp::Importer& importer) {
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, true);  // folded, channels on pivots lose their nodes
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_STRICT_MODE, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_TEXTURES, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_MATERIALS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_CAMERAS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_LIGHTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);  // no invented meshes of bones
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
}

/// Reads one file; the numbers in brackets count the faults of assimp 5.2.5 that are made good.
class AssimpReader {
 public:
  explicit AssimpReader(const std::string& path) : path_(path) {
    scene_.format = format_of(path);
    set_up(importer_);
    // The validation refuses scenes without a mesh, which is what BVH files are.
    const unsigned validation = scene_.format == "bvh" ? 0U : static_cast<unsigned>(aiProcess_ValidateDataStructure);
    theirs_ = read_in_triangles(importer_, path, validation);
    if (theirs_ == nullptr || theirs_->mRootNode == nullptr) refuse_file(importer_.GetErrorString());
  }

  Scene read() {
    read_unit_and_axes();
    for (unsigned m = 0; m < theirs_->mNumMeshes; ++m) {
      for (unsigned b = 0; b < theirs_->mMeshes[m]->mNumBones; ++b)
        joint_names_[theirs_->mMeshes[m]->mBones[b]->mName.C_Str()] = -1;
    }
    walk(theirs_->mRootNode, -1, {});
    for (auto& [name, node] : joint_names_) node = joint_node(name);
    for (unsigned a = 0; a < theirs_->mNumAnimations; ++a) read_clip(*theirs_->mAnimations[a]);
    for (const auto& [node, place] : meshes_on_) read_mesh(node, place);
    forget_morphs_without_shape(scene_);
    read_all_materials();
    return std::move(scene_);
  }

 private:
  struct Place {
    int node, part;
  };
  /// What has been passed on the way down to the node that it belongs to.
  struct Pivots {
    std::vector<Eigen::Affine3d> parts;
    std::vector<const aiNode*> part_nodes;
    Eigen::Affine3d geometry = Eigen::Affine3d::Identity();
  };

  [[noreturn]] void refuse_file(const std::string& reason) const {
    const bool old = reason.find("old format version") != std::string::npos;
    throw Error(path_, "import", old ? "it is an FBX file of before 2011" : "it cannot be read (" + reason + ")",
                scene_.format == "bvh" || scene_.format == "collada"
                    ? "Export the file anew"
                    : "Export it anew as FBX 2013 or later, or as glTF 2.0");
  }

  template <typename Number>
  Number setting(const char* name, Number otherwise) const {
    Number value = otherwise;
    if (theirs_->mMetaData != nullptr && theirs_->mMetaData->Get(name, value)) return value;
    return otherwise;
  }

  void read_unit_and_axes() {
    if (scene_.format != "fbx") return;  // Collada's unit and axis are on its root node
    const double unit_cm = setting("UnitScaleFactor", static_cast<double>(setting("UnitScaleFactor", 1.0f)));
    if (!(unit_cm > 0) || !std::isfinite(unit_cm))
      throw Error(path_, "UnitScaleFactor", "it is not positive", "Export the file anew");
    scene_.metres_per_unit = unit_cm / 100;
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
    const std::array<std::pair<const char*, const char*>, 3> axes{
        {{"CoordAxis", "CoordAxisSign"}, {"UpAxis", "UpAxisSign"}, {"FrontAxis", "FrontAxisSign"}}};
    for (int row = 0; row < 3; ++row) {
      const auto& [axis_name, sign_name] = axes[static_cast<std::size_t>(row)];
      const int axis = setting(axis_name, row), sign = setting(sign_name, 1) < 0 ? -1 : 1;
      if (axis < 0 || axis > 2) throw Error(path_, axis_name, "it names no axis", "Export the file anew");
      turn(row, axis) = sign;
      if (row == 1) scene_.up = std::string(sign < 0 ? "-" : "") + "xyz"[axis];
    }
    if (std::abs(turn.determinant()) < 0.5)
      throw Error(path_, "axis system", "two axes are the same", "Export the file anew");
    if (turn.determinant() < 0) {
      turn.row(2) *= -1;
      scene_.warnings.push_back("The file's axes are left-handed; its front axis is turned round.");
    }
    scene_.to_y_up = turn;
  }

  /// Makes one scene node of a node and the chain of pivots above it. [2, 5]
  void walk(const aiNode* node, int parent, Pivots pivots) {
    const std::string_view pivot = pivot_of(node->mName.C_Str());
    const Eigen::Affine3d local = to_eigen(node->mTransformation);
    if (!local.matrix().allFinite())
      throw Error(path_, node_place(node), "its transform is not finite", "Export the file anew");
    if (pivot.starts_with("Geometric")) {
      // Moves the node's own mesh alone; its inverse, below the node, keeps it from the children.
      if (!pivot.ends_with("Inverse")) pivots.geometry = pivots.geometry * local;
    } else if (!pivot.empty()) {
      pivots.parts.push_back(local);
      pivots.part_nodes.push_back(node);
    } else {
      parent = add_node(node, parent, local, pivots);
      pivots = {};
    }
    for (unsigned c = 0; c < node->mNumChildren; ++c) walk(node->mChildren[c], parent, pivots);
  }

  int add_node(const aiNode* node, int parent, const Eigen::Affine3d& local, const Pivots& pivots) {
    SceneNode ours;
    ours.name = node->mName.C_Str();
    ours.parent = parent;
    ours.parts = pivots.parts;
    ours.parts.push_back(local);
    ours.holds_mesh = node->mNumMeshes > 0;
    ours.inheritance = inheritance_of(node, pivots);
    const int index = static_cast<int>(scene_.nodes.size());
    for (std::size_t p = 0; p < pivots.part_nodes.size(); ++p) {
      places_[pivots.part_nodes[p]->mName.C_Str()].push_back({index, static_cast<int>(p)});
    }
    places_[ours.name].push_back({index, static_cast<int>(pivots.parts.size())});
    if (ours.holds_mesh) meshes_on_.emplace_back(node, index);
    geometry_.push_back(pivots.geometry);
    scene_.nodes.push_back(std::move(ours));
    return index;
  }

  /// FBX InheritType, which assimp keeps and does not apply; it stands at one node of the chain. [4]
  ScaleInheritance inheritance_of(const aiNode* node, const Pivots& pivots) const {
    if (scene_.format != "fbx") return ScaleInheritance::kOrdinary;
    std::vector<const aiNode*> chain = pivots.part_nodes;
    chain.push_back(node);
    for (const aiNode* link : chain) {
      int type = 0;
      if (link->mMetaData == nullptr || !link->mMetaData->Get("InheritType", type)) continue;
      if (type == 1) return ScaleInheritance::kOrdinary;
      if (type == 2) return ScaleInheritance::kCompensated;
    }
    return ScaleInheritance::kAfterRotation;
  }

  static std::string node_place(const aiNode* node) { return std::string("node '") + node->mName.C_Str() + "'"; }

  /// Names repeat: a bone often has a mesh of its name below it. The one without a mesh is meant. [6]
  std::vector<Place> places_without_mesh(const std::string& name) const {
    const auto found = places_.find(name);
    if (found == places_.end()) return {};
    std::vector<Place> bare;
    for (const Place& place : found->second) {
      if (!scene_.nodes[static_cast<std::size_t>(place.node)].holds_mesh) bare.push_back(place);
    }
    return bare.empty() ? found->second : bare;
  }

  int joint_node(const std::string& name) {
    const std::vector<Place> places = places_without_mesh(name);
    if (places.empty()) throw Error(path_, "bone '" + name + "'", "no node has its name", "Export the file anew");
    if (places.size() > 1) {
      throw Error(path_, "bone '" + name + "'", "two bones have this name", "Rename one of them and export the file anew");
    }
    scene_.nodes[static_cast<std::size_t>(places.front().node)].is_joint = true;
    return places.front().node;
  }

  std::optional<Place> channel_place(const std::string& name) const {
    const std::vector<Place> places = places_without_mesh(name);
    if (places.empty()) return std::nullopt;
    for (const Place& place : places) {
      if (scene_.nodes[static_cast<std::size_t>(place.node)].is_joint) return place;
    }
    return places.front();
  }

  void read_clip(const aiAnimation& theirs) {
    SceneClip clip;
    clip.name = theirs.mName.C_Str();
    double ticks = theirs.mTicksPerSecond;
    if (ticks == 0 || !std::isfinite(ticks)) {
      ticks = kDefaultTicksPerSecond;
      scene_.warnings.push_back("Clip '" + clip.name + "' tells no rate; 25 ticks a second are assumed.");
    }
    clip.duration_s = theirs.mDuration / ticks;
    if (!std::isfinite(clip.duration_s))
      throw Error(path_, "clip '" + clip.name + "'", "its duration is not finite", "Export it anew");
    std::map<std::pair<int, int>, Channel> channels;
    std::vector<int> whole;  // nodes with a channel of their own name
    for (unsigned c = 0; c < theirs.mNumChannels; ++c) {
      const aiNodeAnim& source = *theirs.mChannels[c];
      const std::string name = source.mNodeName.C_Str();
      const std::optional<Place> place = channel_place(name);
      if (!place) continue;  // moves a camera, a light or a geometric pivot
      channels[{place->node, place->part}] =
          read_channel(source, *place, ticks, "clip '" + clip.name + "', node '" + name + "'");
      if (pivot_of(name).empty()) whole.push_back(place->node);
    }
    for (unsigned m = 0; m < theirs.mNumMorphMeshChannels; ++m) read_morphs(*theirs.mMorphMeshChannels[m], ticks, clip);
    for (const int node : whole) still_pivots(node, channels);
    for (auto& [place, channel] : channels) clip.channels.push_back(std::move(channel));
    if (scene_.format == "fbx") {
      for (std::string& warning : lost_curve_warnings(scene_, clip, std::min(1 / std::abs(ticks), kLongestFrame)))
        scene_.warnings.push_back(std::move(warning));
    }
    scene_.clips.push_back(std::move(clip));
  }

  /// Weights of morph targets, key by key of those that have one there. The channel is named after a node with meshes, in
  /// FBX with the number of the geometry behind a star. At rest nothing is worn: assimp tells of no other weight.
  void read_morphs(const aiMeshMorphAnim& theirs, double ticks, SceneClip& clip) {
    const std::string name = theirs.mName.C_Str();
    const aiNode* holder = holder_of_mesh(name);
    if (holder == nullptr) holder = holder_of_mesh(name.substr(0, name.rfind('*')));
    if (holder == nullptr) return;
    unsigned targets = 0;
    for (unsigned m = 0; m < holder->mNumMeshes; ++m)
      targets = std::max(targets, theirs_->mMeshes[holder->mMeshes[m]]->mNumAnimMeshes);
    std::map<unsigned, std::pair<std::vector<double>, std::vector<double>>> courses;
    for (unsigned k = 0; k < theirs.mNumKeys; ++k) {
      const aiMeshMorphKey& key = theirs.mKeys[k];
      for (unsigned i = 0; i < key.mNumValuesAndWeights; ++i) {
        if (key.mValues[i] >= targets) continue;
        auto& [times, weights] = courses[key.mValues[i]];
        times.push_back(key.mTime / ticks);
        weights.push_back(key.mWeights[i]);
      }
    }
    const std::string where = "clip '" + clip.name + "', node '" + holder->mName.C_Str() + "'";
    for (auto& [target, course] : courses) {
      auto& [times, weights] = course;
      MorphChannel channel{place_of(holder), static_cast<int>(target), {}};
      channel.weight.times = std::move(times);
      channel.weight.values = Eigen::Map<const Eigen::RowVectorXd>(weights.data(), static_cast<Eigen::Index>(weights.size()));
      make_sound(channel.weight, path_, where);
      if (is_still(channel.weight, 0)) continue;
      moving_morphs_.emplace(channel.node, channel.target);
      clip.morphs.push_back(std::move(channel));
    }
  }

  int place_of(const aiNode* holder) const {
    return std::find_if(meshes_on_.begin(), meshes_on_.end(), [&](const auto& held) { return held.first == holder; })->second;
  }

  const aiNode* holder_of_mesh(const std::string& name) const {
    for (const auto& [node, place] : meshes_on_) {
      if (name == node->mName.C_Str()) return node;
    }
    return nullptr;
  }

  /// The shapes of the targets that some clip moves; assimp keeps a mesh as each makes it.
  void read_shapes(const aiMesh& theirs, SceneMesh& ours) {
    for (unsigned t = 0; t < theirs.mNumAnimMeshes; ++t) {
      const aiAnimMesh& target = *theirs.mAnimMeshes[t];
      SceneMesh::Morph& morph = ours.morphs.emplace_back();
      morph.name = target.mName.length > 0 ? target.mName.C_Str() : "target_" + std::to_string(t);
      const bool moves = moving_morphs_.contains({ours.node, static_cast<int>(t)});
      if (!moves || target.mVertices == nullptr || target.mNumVertices != theirs.mNumVertices) continue;
      Eigen::Matrix3Xd offsets(3, theirs.mNumVertices);
      for (unsigned v = 0; v < theirs.mNumVertices; ++v)
        offsets.col(v) = to_eigen(target.mVertices[v]) - to_eigen(theirs.mVertices[v]);
      if (offsets.allFinite()) {
        set_shape(offsets, morph);
      } else {
        scene_.warnings.push_back("Mesh '" + ours.name + "': morph target '" + morph.name +
                                  "' holds still as at rest: an offset is not finite.");
      }
    }
  }

  /// A channel of the node's own name holds the whole local transform, pivots included: those above it must not count twice.
  /// [3]
  void still_pivots(int node, std::map<std::pair<int, int>, Channel>& channels) {
    const SceneNode& ours = scene_.nodes[static_cast<std::size_t>(node)];
    for (int part = 0; part + 1 < static_cast<int>(ours.parts.size()); ++part) {
      if (channels.contains({node, part})) continue;
      Channel still;
      still.node = node;
      still.part = part;
      still.translation = {Interpolation::kLinear, {0}, Eigen::Vector3d::Zero(), {}, {}};
      still.rotation = {Interpolation::kLinear, {0}, Eigen::Quaterniond::Identity().coeffs(), {}, {}};
      still.scale = {Interpolation::kLinear, {0}, Eigen::Vector3d::Ones(), {}, {}};
      channels[{node, part}] = std::move(still);
    }
    if (places_.contains(ours.name + std::string(kPivotMark) + "PostRotation")) {
      scene_.warnings.push_back("Node '" + ours.name +
                                "' has a post-rotation, which may be read the wrong way round; bake it before export.");
    }
  }

  Channel read_channel(const aiNodeAnim& source, const Place& place, double ticks, const std::string& where) const {
    Channel channel;
    channel.node = place.node;
    channel.part = place.part;
    const auto read = [&]<typename Key, typename Take>(Track& track, const Key* keys, unsigned count, int rows,
                                                       Take&& take) {
      track.values.resize(rows, static_cast<Eigen::Index>(count));
      for (unsigned k = 0; k < count; ++k) {
        track.times.push_back(keys[k].mTime / ticks);
        track.values.col(static_cast<Eigen::Index>(k)) = take(keys[k].mValue);
      }
      make_sound(track, path_, where);
    };
    const auto vector = [](const aiVector3D& value) { return to_eigen(value); };
    const auto rotation = [](const aiQuaternion& value) { return Eigen::Vector4d(value.x, value.y, value.z, value.w); };
    read(channel.translation, source.mPositionKeys, source.mNumPositionKeys, 3, vector);
    read(channel.rotation, source.mRotationKeys, source.mNumRotationKeys, 4, rotation);
    read(channel.scale, source.mScalingKeys, source.mNumScalingKeys, 3, vector);
    return channel;
  }

  void read_all_materials() {
    if (scene_.format == "collada") read_materials(*theirs_, scene_);
    if (scene_.format == "fbx" && !scene_.meshes.empty()) read_fbx_materials(path_, *theirs_, scene_);
    // What assimp made up is as good as none.
    for (SceneMesh& mesh : scene_.meshes) {
      for (int& material : mesh.triangle_materials) {
        const bool is_there = material >= 0 && static_cast<std::size_t>(material) < scene_.materials.size();
        if (!is_there || scene_.materials[static_cast<std::size_t>(material)].name.empty()) material = -1;
      }
    }
  }

  void read_mesh(const aiNode* node, int place) {
    for (unsigned m = 0; m < node->mNumMeshes; ++m) {
      const aiMesh& theirs = *theirs_->mMeshes[node->mMeshes[m]];
      SceneMesh ours;
      ours.name = theirs.mName.length > 0 ? theirs.mName.C_Str() : node->mName.C_Str();
      ours.node = place;
      read_surface(theirs, ours);
      if (ours.triangles.cols() == 0) continue;
      read_shapes(theirs, ours);
      read_looks(theirs, static_cast<int>(theirs.mMaterialIndex), ours);
      for (unsigned b = 0; b < theirs.mNumBones; ++b) ours.joints.push_back(read_joint(*theirs.mBones[b], ours));
      // The offset matrices of 3ds Max files lack what moves the mesh alone. [5]
      const Eigen::Affine3d& geometry = geometry_[static_cast<std::size_t>(place)];
      ours.vertices = geometry * ours.vertices;
      for (SceneMesh::Morph& morph : ours.morphs) morph.offsets = geometry.linear() * morph.offsets;
      if (std::abs(geometry.linear().determinant()) > 0)
        ours.normals = geometry.linear().inverse().transpose() * ours.normals;
      scene_.meshes.push_back(std::move(ours));
    }
  }

  void read_surface(const aiMesh& theirs, SceneMesh& ours) const {
    ours.vertices.resize(3, theirs.mNumVertices);
    for (unsigned v = 0; v < theirs.mNumVertices; ++v) ours.vertices.col(v) = to_eigen(theirs.mVertices[v]);
    if (!ours.vertices.allFinite())
      throw Error(path_, "mesh '" + ours.name + "'", "a vertex is not finite", "Repair the mesh");
    std::vector<Eigen::Vector3i> triangles;
    for (unsigned f = 0; f < theirs.mNumFaces; ++f) {
      const aiFace& face = theirs.mFaces[f];
      if (face.mNumIndices != 3) continue;  // a control curve
      triangles.emplace_back(static_cast<int>(face.mIndices[0]), static_cast<int>(face.mIndices[1]),
                             static_cast<int>(face.mIndices[2]));
    }
    ours.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
    for (std::size_t t = 0; t < triangles.size(); ++t) ours.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  }

  SceneMesh::Joint read_joint(const aiBone& theirs, const SceneMesh& mesh) const {
    SceneMesh::Joint ours;
    ours.node = joint_names_.at(theirs.mName.C_Str());
    ours.inverse_bind_matrix = to_eigen(theirs.mOffsetMatrix);
    if (!ours.inverse_bind_matrix.matrix().allFinite()) {
      throw Error(path_, std::string("bone '") + theirs.mName.C_Str() + "'", "its inverse bind matrix is not finite",
                  "Bind the skin anew");
    }
    for (unsigned w = 0; w < theirs.mNumWeights; ++w) {
      const aiVertexWeight& weight = theirs.mWeights[w];
      const bool sound = std::isfinite(weight.mWeight) && weight.mWeight > 0 && weight.mVertexId < mesh.vertices.cols();
      if (sound) ours.weights.push_back({static_cast<int>(weight.mVertexId), weight.mWeight});
    }
    return ours;
  }

  const std::string path_;
  Assimp::Importer importer_;
  const aiScene* theirs_ = nullptr;  // the importer's
  Scene scene_;
  std::unordered_map<std::string, std::vector<Place>> places_;  // of each name
  std::map<std::string, int> joint_names_;                      // node of each bone
  std::vector<std::pair<const aiNode*, int>> meshes_on_;
  std::set<std::pair<int, int>> moving_morphs_;  // scene node and target
  std::vector<Eigen::Affine3d> geometry_;  // of each scene node: what moves its own mesh alone
};

}  // namespace

Scene read_with_assimp(const std::string& path) { return AssimpReader(path).read(); }

}  // namespace hydrostat::io

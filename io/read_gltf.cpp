#include <tiny_gltf.h>

#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>

#include "io/gltf_materials.h"
#include "io/read_scene.h"
#include "io/scene_morphs.h"
#include "io/track.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr const char* kExportAnew = "Export the file anew";
constexpr double kFarthestPlace = 1e6;          // in an image, in its widths
constexpr std::size_t kMostMorphOffsets = 4'000'000;
constexpr std::size_t kMostSparse = 5'000'000;  // elements of an accessor that no buffer bounds

/// Keeps the bytes of an image that the text holds as data; others lie where they can be read at leisure.
bool keep_image(tinygltf::Image* image, const int index, std::string*, std::string*, int, int, const unsigned char* bytes,
                int size, void* kept) {
  auto& images = *static_cast<std::vector<std::string>*>(kept);
  images.resize(std::max(images.size(), static_cast<std::size_t>(index) + 1));
  if (image->bufferView < 0 && image->uri.empty())
    images[static_cast<std::size_t>(index)].assign(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size));
  return true;
}

std::string upper_first(std::string text) {
  if (!text.empty()) text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

tinygltf::Model load(const std::string& path, std::vector<std::string>& images) {
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_image, &images);
  tinygltf::Model model;
  std::string failure, warning;
  std::string extension = std::filesystem::path(path).extension().string();
  const bool binary = extension.size() == 4;  // .glb, in whichever case
  const bool read = binary ? loader.LoadBinaryFromFile(&model, &failure, &warning, path)
                           : loader.LoadASCIIFromFile(&model, &failure, &warning, path);
  if (!read) throw Error(path, "import", "it is no whole glTF 2.0 file (" + first_line(failure) + ")", kExportAnew);
  for (const std::string& extension_name : model.extensionsRequired) {
    if (extension_name == "KHR_draco_mesh_compression" || extension_name == "EXT_meshopt_compression") {
      throw Error(path, "extension " + extension_name, "its data is compressed in a way that is not read",
                  "Export it uncompressed");
    }
  }
  return model;
}

/// One number of an accessor's component type; a normalised integer as the fraction it means.
/// Source: glTF 2.0, section 3.6.2.2 and "Animations" (f = max(c / 127, -1) and so on).
double decode(const unsigned char* at, int component_type, bool normalised) {
  const auto fraction = [&]<typename Integer>(Integer value) {
    std::memcpy(&value, at, sizeof(Integer));
    const auto number = static_cast<double>(value);
    return normalised ? std::max(number / static_cast<double>(std::numeric_limits<Integer>::max()), -1.0) : number;
  };
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return fraction(std::int8_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return fraction(std::uint8_t{});
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return fraction(std::int16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return fraction(std::uint16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return fraction(std::uint32_t{});
    default:
      break;
  }
  float value = 0;
  std::memcpy(&value, at, sizeof value);
  return value;
}

/// Reads one file; its parts become ours one after the other.
class GltfReader {
 public:
  explicit GltfReader(const std::string& path) : path_(path), model_(load(path, images_)) {}

  Scene read() {
    scene_.format = "gltf";
    scene_.materials = read_materials(model_, scene_.warnings);
    scene_.images = read_images(model_, images_);
    read_nodes();
    for (std::size_t a = 0; a < model_.animations.size(); ++a) read_clip(model_.animations[a], a);
    read_meshes();
    forget_morphs_without_shape(scene_);
    return std::move(scene_);
  }

 private:
  [[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& mend = kExportAnew) const {
    throw Error(path_, where, what, mend);
  }

  template <typename Item>
  const Item& at(const std::vector<Item>& items, int index, const std::string& where) const {
    if (index < 0 || static_cast<std::size_t>(index) >= items.size())
      refuse(where, "it points to something that is not in the file");
    return items[static_cast<std::size_t>(index)];
  }

  /// Elements one after the other in a buffer view, as columns.
  struct Place {
    int view;
    std::size_t offset;  // [bytes] in the view
    std::size_t count, stride;
    int component_type;
    bool normalised;
  };
  Eigen::MatrixXd numbers_at(const Place& place, Eigen::Index components, const std::string& where) const {
    const tinygltf::BufferView& view = at(model_.bufferViews, place.view, where);
    const tinygltf::Buffer& buffer = at(model_.buffers, view.buffer, where);
    const int width = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(place.component_type));
    const auto element = static_cast<std::size_t>(width) * static_cast<std::size_t>(components);
    const std::size_t stride = place.stride > 0 ? place.stride : element;
    const std::size_t limit = std::min(buffer.data.size(), view.byteOffset + view.byteLength);
    const std::size_t start = view.byteOffset + place.offset;
    if (place.count > limit || stride > limit || start > limit || start + (place.count - 1) * stride + element > limit) {
      refuse(where, "its data runs past the end of the file's buffer");
    }
    Eigen::MatrixXd values(components, static_cast<Eigen::Index>(place.count));
    for (Eigen::Index e = 0; e < values.cols(); ++e) {
      const unsigned char* from = buffer.data.data() + start + static_cast<std::size_t>(e) * stride;
      for (Eigen::Index c = 0; c < components; ++c)
        values(c, e) = decode(from + c * width, place.component_type, place.normalised);
    }
    return values;
  }

  /// An accessor's numbers, one element a column. `normalise_integers` for data that may only be normalised (weights,
  /// rotations). Sparse ones too: what they list stands in for what lies below, zeros where nothing does.
  Eigen::MatrixXd numbers(int index, Eigen::Index components, const std::string& where,
                          bool normalise_integers = false) const {
    const tinygltf::Accessor& accessor = at(model_.accessors, index, where);
    const int width = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
    if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != components || width <= 0 ||
        width > 4) {
      refuse(where, "its data has the wrong type");
    }
    if (accessor.count == 0) refuse(where, "its data is empty or misplaced");
    const bool normalised = accessor.normalized || normalise_integers;
    if (!accessor.sparse.isSparse || accessor.bufferView >= 0) {
      const int stride = accessor.ByteStride(at(model_.bufferViews, accessor.bufferView, where));
      if (stride <= 0) refuse(where, "its data is empty or misplaced");
      Eigen::MatrixXd values = numbers_at({accessor.bufferView, accessor.byteOffset, accessor.count,
                                           static_cast<std::size_t>(stride), accessor.componentType, normalised},
                                          components, where);
      if (accessor.sparse.isSparse) put_listed(accessor, normalised, where, values);
      return values;
    }
    if (accessor.count > kMostSparse) refuse(where, "its data has more than " + std::to_string(kMostSparse) + " elements");
    Eigen::MatrixXd values = Eigen::MatrixXd::Zero(components, static_cast<Eigen::Index>(accessor.count));
    put_listed(accessor, normalised, where, values);
    return values;
  }

  /// Source: glTF 2.0, section 3.6.2.3.
  void put_listed(const tinygltf::Accessor& accessor, bool normalised, const std::string& where,
                  Eigen::MatrixXd& values) const {
    const auto& sparse = accessor.sparse;
    const int type = sparse.indices.componentType;
    if (sparse.count < 1 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 ||
        (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
         type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)) {
      refuse(where, "its sparse data is empty or misplaced");
    }
    const auto count = static_cast<std::size_t>(sparse.count);
    const Eigen::MatrixXd places = numbers_at(
        {sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count, 0, type, false}, 1, where);
    const Eigen::MatrixXd listed = numbers_at({sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset),
                                               count, 0, accessor.componentType, normalised},
                                              values.rows(), where);
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      if (places(0, i) >= static_cast<double>(values.cols()))
        refuse(where, "its sparse data names an element that is not there");
      values.col(static_cast<Eigen::Index>(places(0, i))) = listed.col(i);
    }
  }

  static Eigen::Affine3d local_transform(const tinygltf::Node& node) {
    Eigen::Affine3d local = Eigen::Affine3d::Identity();
    if (node.matrix.size() == 16) {
      local.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
      local.makeAffine();
      return local;
    }
    if (node.translation.size() == 3) local.translate(Eigen::Vector3d(node.translation.data()));
    if (node.rotation.size() == 4) local.rotate(Eigen::Quaterniond(node.rotation.data()).normalized());
    if (node.scale.size() == 3) local.scale(Eigen::Vector3d(node.scale.data()));
    return local;
  }

  void read_nodes() {
    std::vector<bool> is_child(model_.nodes.size(), false);
    for (const tinygltf::Node& node : model_.nodes) {
      for (const int child : node.children) {
        at(model_.nodes, child, "nodes");
        if (is_child[static_cast<std::size_t>(child)]) refuse("node " + std::to_string(child), "it hangs below two nodes");
        is_child[static_cast<std::size_t>(child)] = true;
      }
    }
    scene_node_.assign(model_.nodes.size(), -1);
    for (std::size_t n = 0; n < model_.nodes.size(); ++n) {
      if (!is_child[n]) add_node(static_cast<int>(n), -1);
    }
    // Whatever no root leads to hangs in a ring.
    if (scene_.nodes.size() != model_.nodes.size()) refuse("nodes", "some nodes are their own ancestors");
    for (const tinygltf::Skin& skin : model_.skins) {
      for (const int joint : skin.joints) scene_.nodes[place(joint, "skin '" + skin.name + "'")].is_joint = true;
    }
  }

  void add_node(int index, int parent) {
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    SceneNode ours;
    ours.name = node.name.empty() ? "node_" + std::to_string(index) : node.name;
    ours.parent = parent;
    ours.parts = {local_transform(node)};
    ours.holds_mesh = node.mesh >= 0;
    if (!ours.parts.front().matrix().allFinite()) refuse("node '" + ours.name + "'", "its transform is not finite");
    const int place = static_cast<int>(scene_.nodes.size());
    scene_node_[static_cast<std::size_t>(index)] = place;
    scene_.nodes.push_back(std::move(ours));
    for (const int child : node.children) add_node(child, place);
  }

  /// The scene node that a node of the file became.
  std::size_t place(int index, const std::string& where) const {
    return static_cast<std::size_t>(at(scene_node_, index, where));
  }

  void read_meshes() {
    for (std::size_t n = 0; n < model_.nodes.size(); ++n) {
      const tinygltf::Node& node = model_.nodes[n];
      if (node.mesh < 0) continue;
      const tinygltf::Mesh& mesh = at(model_.meshes, node.mesh, "node '" + node.name + "'");
      for (const tinygltf::Primitive& primitive : mesh.primitives) read_primitive(primitive, mesh, node, scene_node_[n]);
    }
  }

  void read_primitive(const tinygltf::Primitive& primitive, const tinygltf::Mesh& mesh, const tinygltf::Node& node,
                      int scene_node) {
    SceneMesh ours;
    ours.name = mesh.name.empty() ? "mesh_" + std::to_string(node.mesh) : mesh.name;
    ours.node = scene_node;
    const std::string where = "mesh '" + ours.name + "'";
    const auto positions = primitive.attributes.find("POSITION");
    if (positions == primitive.attributes.end()) return;
    ours.vertices = numbers(positions->second, 3, where);
    ours.morphs = morphs(primitive, mesh, node);
    add_morph_targets(primitive, where, ours);
    if (!ours.vertices.allFinite()) refuse(where, "a vertex is not finite");
    read_moving_morphs(primitive, where, ours);
    ours.triangles = triangles(primitive, ours.vertices.cols(), where);
    if (ours.triangles.cols() == 0) return;  // points or lines
    read_looks(primitive, where, ours);
    if (node.skin >= 0) ours.joints = joints(primitive, at(model_.skins, node.skin, where), ours.vertices.cols(), where);
    scene_.meshes.push_back(std::move(ours));
  }

  void read_looks(const tinygltf::Primitive& primitive, const std::string& where, SceneMesh& ours) {
    const bool has_material =
        primitive.material >= 0 && static_cast<std::size_t>(primitive.material) < scene_.materials.size();
    ours.triangle_materials.setConstant(ours.triangles.cols(), has_material ? primitive.material : -1);
    // A character whose looks are broken is still one.
    const auto attribute = [&](const std::string& name, Eigen::Index components, bool normalise) {
      const auto found = primitive.attributes.find(name);
      Eigen::MatrixXd values(components, 0);
      if (found == primitive.attributes.end()) return values;
      try {
        values = numbers(found->second, components, where, normalise);
        if (values.cols() != ours.vertices.cols()) refuse(where, "it has not as many as vertices");
      } catch (const Error& error) {
        scene_.warnings.push_back(upper_first(where) + ": " + name + " is left out: " + error.what() + ".");
        values.resize(components, 0);
      }
      return Eigen::MatrixXd(values.unaryExpr([](double value) { return std::isfinite(value) ? value : 0.0; }));
    };
    ours.normals = attribute("NORMAL", 3, true);
    if (!has_material && !primitive.attributes.contains("COLOR_0")) return;
    for (int set = 0; has_material && primitive.attributes.contains("TEXCOORD_" + std::to_string(set)); ++set) {
      const Eigen::MatrixXd places = attribute("TEXCOORD_" + std::to_string(set), 2, false);
      ours.uvs.emplace_back(places.cwiseMax(-kFarthestPlace).cwiseMin(kFarthestPlace));
    }
    const auto colours = primitive.attributes.find("COLOR_0");
    if (colours == primitive.attributes.end()) return;
    const bool has_alpha = at(model_.accessors, colours->second, where).type == TINYGLTF_TYPE_VEC4;
    const Eigen::MatrixXd told = attribute("COLOR_0", has_alpha ? 4 : 3, true);
    ours.colours.setOnes(4, told.cols());
    ours.colours.topRows(told.rows()) = told.cwiseMax(0).cwiseMin(1);
  }

  static double weight_at_rest(const tinygltf::Mesh& mesh, const tinygltf::Node& node, std::size_t target) {
    const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
    return target < weights.size() ? weights[target] : 0;
  }

  /// Names and weights at rest. Names are where most exporters put them.
  std::vector<SceneMesh::Morph> morphs(const tinygltf::Primitive& primitive, const tinygltf::Mesh& mesh,
                                       const tinygltf::Node& node) const {
    std::vector<SceneMesh::Morph> ours(primitive.targets.size());
    const tinygltf::Value names = mesh.extras.IsObject() ? mesh.extras.Get("targetNames") : tinygltf::Value();
    for (std::size_t t = 0; t < ours.size(); ++t) {
      const bool is_named = names.IsArray() && t < names.ArrayLen() && names.Get(static_cast<int>(t)).IsString();
      ours[t].name = is_named ? names.Get(static_cast<int>(t)).Get<std::string>() : "target_" + std::to_string(t);
      ours[t].weight = weight_at_rest(mesh, node, t);
    }
    return ours;
  }

  /// Moves the vertices by the morph targets as the mesh wears them at rest.
  void add_morph_targets(const tinygltf::Primitive& primitive, const std::string& where, SceneMesh& ours) const {
    for (std::size_t t = 0; t < primitive.targets.size(); ++t) {
      const auto positions = primitive.targets[t].find("POSITION");
      if (positions == primitive.targets[t].end() || ours.morphs[t].weight == 0) continue;
      const Eigen::MatrixXd offsets = numbers(positions->second, 3, where);
      if (offsets.cols() != ours.vertices.cols()) refuse(where, "a morph target has not as many vertices as the mesh");
      ours.vertices += ours.morphs[t].weight * offsets;
    }
  }

  /// The shapes of those targets that some clip moves.
  void read_moving_morphs(const tinygltf::Primitive& primitive, const std::string& where, SceneMesh& ours) {
    for (std::size_t t = 0; t < ours.morphs.size(); ++t) {
      const auto positions = primitive.targets[t].find("POSITION");
      if (positions == primitive.targets[t].end() || !moving_morphs_.contains({ours.node, static_cast<int>(t)})) continue;
      SceneMesh::Morph& morph = ours.morphs[t];
      // A character whose face is broken is still one.
      try {
        const Eigen::MatrixXd offsets = numbers(positions->second, 3, where);
        if (offsets.cols() != ours.vertices.cols()) refuse(where, "it has not as many vertices as the mesh");
        if (!offsets.allFinite()) refuse(where, "an offset is not finite");
        set_shape(offsets, morph);
        morph_offsets_ += static_cast<std::size_t>(morph.vertices.size());
        if (morph_offsets_ <= kMostMorphOffsets) continue;
        set_shape({}, morph);
        refuse(where, "the file's targets move more than " + std::to_string(kMostMorphOffsets) + " vertices");
      } catch (const Error& error) {
        scene_.warnings.push_back(upper_first(where) + ": morph target '" + morph.name + "' holds still as at rest: " +
                                  error.what() + ".");
      }
    }
  }

  Eigen::Matrix3Xi triangles(const tinygltf::Primitive& primitive, Eigen::Index vertices, const std::string& where) const {
    std::vector<int> corners;
    if (primitive.indices >= 0) {
      const Eigen::MatrixXd indices = numbers(primitive.indices, 1, where);
      if (indices.minCoeff() < 0 || indices.maxCoeff() >= static_cast<double>(vertices)) {
        refuse(where, "a triangle names a vertex that is not there");
      }
      for (Eigen::Index i = 0; i < indices.size(); ++i) corners.push_back(static_cast<int>(indices(i)));
    } else {
      for (int i = 0; i < vertices; ++i) corners.push_back(i);
    }
    std::vector<Eigen::Vector3i> found;
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    const std::size_t step = mode == TINYGLTF_MODE_TRIANGLES ? 3 : 1;
    for (std::size_t i = 0; i + 2 < corners.size(); i += step) {
      const bool odd = mode == TINYGLTF_MODE_TRIANGLE_STRIP && i % 2 == 1;
      const int first = mode == TINYGLTF_MODE_TRIANGLE_FAN ? corners[0] : corners[i];
      if (mode >= TINYGLTF_MODE_TRIANGLES) found.emplace_back(first, corners[i + (odd ? 2 : 1)], corners[i + (odd ? 1 : 2)]);
    }
    Eigen::Matrix3Xi ours(3, static_cast<Eigen::Index>(found.size()));
    for (std::size_t t = 0; t < found.size(); ++t) ours.col(static_cast<Eigen::Index>(t)) = found[t];
    return ours;
  }

  std::vector<SceneMesh::Joint> joints(const tinygltf::Primitive& primitive, const tinygltf::Skin& skin,
                                       Eigen::Index vertices, const std::string& where) {
    const std::string skin_place = "skin '" + skin.name + "'";
    // Without such matrices they are identities.
    Eigen::MatrixXd matrices =
        Eigen::Matrix4d::Identity().reshaped().replicate(1, static_cast<Eigen::Index>(skin.joints.size()));
    if (skin.inverseBindMatrices >= 0) matrices = numbers(skin.inverseBindMatrices, 16, skin_place);
    if (matrices.cols() < static_cast<Eigen::Index>(skin.joints.size())) {
      refuse(skin_place, "it has " + std::to_string(matrices.cols()) + " inverse bind matrices for " +
                             std::to_string(skin.joints.size()) + " joints");
    }
    std::vector<SceneMesh::Joint> ours(skin.joints.size());
    for (std::size_t j = 0; j < ours.size(); ++j) {
      ours[j].node = static_cast<int>(place(skin.joints[j], skin_place));
      ours[j].inverse_bind_matrix.matrix() = matrices.col(static_cast<Eigen::Index>(j)).reshaped(4, 4);
      ours[j].inverse_bind_matrix.makeAffine();
      if (!ours[j].inverse_bind_matrix.matrix().allFinite()) refuse(skin_place, "an inverse bind matrix is not finite");
    }
    for (int set = 0; read_weights(primitive, set, vertices, where, ours); ++set) {
    }
    return ours;
  }

  /// Four influences a vertex from JOINTS_<set> and WEIGHTS_<set>; false when there is no such set.
  bool read_weights(const tinygltf::Primitive& primitive, int set, Eigen::Index vertices, const std::string& where,
                    std::vector<SceneMesh::Joint>& ours) {
    const auto joint_entry = primitive.attributes.find("JOINTS_" + std::to_string(set));
    const auto weight_entry = primitive.attributes.find("WEIGHTS_" + std::to_string(set));
    if (joint_entry == primitive.attributes.end() || weight_entry == primitive.attributes.end()) return false;
    const Eigen::MatrixXd joint = numbers(joint_entry->second, 4, where);
    const Eigen::MatrixXd weight = numbers(weight_entry->second, 4, where, true);
    if (joint.cols() != vertices || weight.cols() != vertices) refuse(where, "it has not as many skin weights as vertices");
    int dropped = 0;
    for (Eigen::Index v = 0; v < vertices; ++v) {
      for (Eigen::Index i = 0; i < 4; ++i) {
        if (weight(i, v) == 0) continue;
        const bool sound = weight(i, v) > 0 && std::isfinite(weight(i, v)) && joint(i, v) < static_cast<double>(ours.size());
        if (sound) ours[static_cast<std::size_t>(joint(i, v))].weights.push_back({static_cast<int>(v), weight(i, v)});
        dropped += sound ? 0 : 1;
      }
    }
    if (dropped > 0) {
      scene_.warnings.push_back(where + ": " + std::to_string(dropped) +
                                " skin weights are negative, not finite or name no joint; they are left out.");
    }
    return true;
  }

  void read_clip(const tinygltf::Animation& animation, std::size_t index) {
    SceneClip clip;
    clip.name = animation.name;
    const std::string where = "clip '" + (clip.name.empty() ? std::to_string(index) : clip.name) + "'";
    std::vector<Channel> by_node(scene_.nodes.size());
    for (const tinygltf::AnimationChannel& channel : animation.channels) {
      if (channel.target_node < 0) continue;
      const std::size_t node = place(channel.target_node, where);
      const bool turns = channel.target_path == "rotation";
      if (channel.target_path == "weights")
        read_morph_channels(at(animation.samplers, channel.sampler, where), channel.target_node, where, clip);
      if (!turns && channel.target_path != "translation" && channel.target_path != "scale") continue;
      Track& track = turns                            ? by_node[node].rotation
                     : channel.target_path == "scale" ? by_node[node].scale
                                                      : by_node[node].translation;
      track = read_track(at(animation.samplers, channel.sampler, where), turns ? 4 : 3,
                         where + ", node '" + scene_.nodes[node].name + "'");
      clip.duration_s = std::max(clip.duration_s, track.times.back());
    }
    for (std::size_t n = 0; n < by_node.size(); ++n) {
      by_node[n].node = static_cast<int>(n);
      if (by_node[n].translation.times.empty() && by_node[n].rotation.times.empty() && by_node[n].scale.times.empty())
        continue;
      clip.channels.push_back(std::move(by_node[n]));
    }
    scene_.clips.push_back(std::move(clip));
  }

  /// A sampler of weights tells of all targets of a node's mesh in turn, key by key. Those that it leaves as at rest are
  /// no channels.
  void read_morph_channels(const tinygltf::AnimationSampler& sampler, int node, const std::string& clip_place,
                           SceneClip& clip) {
    const tinygltf::Node& theirs = model_.nodes[static_cast<std::size_t>(node)];
    if (theirs.mesh < 0) return;
    const std::string where = clip_place + ", node '" + scene_.nodes[place(node, clip_place)].name + "'";
    const tinygltf::Mesh& mesh = at(model_.meshes, theirs.mesh, where);
    const std::size_t targets = mesh.primitives.empty() ? 0 : mesh.primitives.front().targets.size();
    if (targets == 0) return;
    try {
      const Track all = read_keys(sampler, 1, static_cast<Eigen::Index>(targets), where);
      for (std::size_t t = 0; t < targets; ++t) {
        MorphChannel channel{static_cast<int>(place(node, where)), static_cast<int>(t), row_of(all, static_cast<Eigen::Index>(t))};
        make_sound(channel.weight, path_, where);
        clip.duration_s = std::max(clip.duration_s, channel.weight.times.back());
        if (is_still(channel.weight, weight_at_rest(mesh, theirs, t))) continue;
        moving_morphs_.emplace(channel.node, channel.target);
        std::erase_if(clip.morphs, [&](const MorphChannel& other) {
          return other.node == channel.node && other.target == channel.target;
        });
        clip.morphs.push_back(std::move(channel));
      }
    } catch (const Error& error) {
      scene_.warnings.push_back(upper_first(where) + ": its morph targets hold still as at rest: " + error.what() + ".");
    }
  }

  static Track row_of(const Track& all, Eigen::Index row) {
    const auto part = [&](const Eigen::MatrixXd& values) -> Eigen::MatrixXd {
      return values.size() > 0 ? Eigen::MatrixXd(values.row(row)) : values;
    };
    return {all.interpolation, all.times, part(all.values), part(all.in_tangents), part(all.out_tangents)};
  }

  Track read_track(const tinygltf::AnimationSampler& sampler, Eigen::Index rows, const std::string& where) const {
    Track track = read_keys(sampler, rows, 1, where);
    make_sound(track, path_, where);
    return track;
  }

  /// Keys as they are, each of `elements` elements of `components` numbers.
  Track read_keys(const tinygltf::AnimationSampler& sampler, Eigen::Index components, Eigen::Index elements,
                  const std::string& where) const {
    Track track;
    if (sampler.interpolation == "STEP") track.interpolation = Interpolation::kStep;
    if (sampler.interpolation == "CUBICSPLINE") track.interpolation = Interpolation::kCubic;
    const bool cubic = track.interpolation == Interpolation::kCubic;
    const Eigen::MatrixXd times = numbers(sampler.input, 1, where);
    Eigen::MatrixXd output = numbers(sampler.output, components, where, components != 3);
    const Eigen::Index keys = times.cols();
    if (output.cols() != keys * elements * (cubic ? 3 : 1)) {
      refuse(where, "it has " + std::to_string(output.cols()) + " values for " + std::to_string(keys) + " key times");
    }
    output.resize(components * elements, output.cols() / elements);
    track.times.assign(times.data(), times.data() + keys);
    track.values = output;
    if (cubic) {  // in-tangent, value, out-tangent of each key in turn
      track.in_tangents = output(Eigen::all, Eigen::seqN(0, keys, 3));
      track.values = output(Eigen::all, Eigen::seqN(1, keys, 3));
      track.out_tangents = output(Eigen::all, Eigen::seqN(2, keys, 3));
    }
    return track;
  }

  const std::string path_;
  std::vector<std::string> images_;  // that the text holds; filled as the model is loaded
  const tinygltf::Model model_;
  Scene scene_;
  std::vector<int> scene_node_;  // of each node of the file
  std::set<std::pair<int, int>> moving_morphs_;  // scene node and target
  std::size_t morph_offsets_ = 0;
};

}  // namespace

Scene read_gltf(const std::string& path) { return GltfReader(path).read(); }

}  // namespace hydrostat::io

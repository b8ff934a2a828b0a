#include "io/gltf_out.h"

#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <sstream>

#include "io/gltf_materials.h"
#include "io/moving_normals.h"
#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

/// Appends arrays to the one buffer of a model and says where they lie.
class BufferWriter {
 public:
  explicit BufferWriter(tinygltf::Model& model) : model_(model) { model_.buffers.emplace_back(); }

  /// A view over `values`; target is ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, or 0 for data that no GPU buffer holds.
  template <typename Number>
  int view(const std::vector<Number>& values, int target) {
    std::vector<unsigned char>& data = model_.buffers.front().data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = values.size() * sizeof(Number);
    view.target = target;
    data.resize(data.size() + view.byteLength);
    std::memcpy(data.data() + view.byteOffset, values.data(), view.byteLength);
    data.resize((data.size() + 3) / 4 * 4, 0);
    model_.bufferViews.push_back(view);
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  int accessor(int view, std::size_t offset, int component, int type, std::size_t count) {
    tinygltf::Accessor accessor;
    accessor.bufferView = view;
    accessor.byteOffset = offset;
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = count;
    model_.accessors.push_back(accessor);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  /// One accessor over all of `values`.
  template <typename Number>
  int array(const std::vector<Number>& values, int target, int component, int type) {
    const auto components = static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<uint32_t>(type)));
    return accessor(view(values, target), 0, component, type, values.size() / components);
  }

  /// Tells the least and greatest value of every component, which glTF asks of positions and key times.
  void set_bounds(int accessor, const std::vector<float>& values) {
    tinygltf::Accessor& told = model_.accessors[static_cast<std::size_t>(accessor)];
    const auto components = static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<uint32_t>(told.type)));
    told.minValues.assign(components, std::numeric_limits<double>::infinity());
    told.maxValues.assign(components, -std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = values[i];
      told.minValues[i % components] = std::min(told.minValues[i % components], value);
      told.maxValues[i % components] = std::max(told.maxValues[i % components], value);
    }
  }

 private:
  tinygltf::Model& model_;
};

std::vector<float> floats(const Eigen::Ref<const Eigen::MatrixXd>& values) {
  std::vector<float> result(static_cast<std::size_t>(values.size()));
  Eigen::Map<Eigen::MatrixXf>(result.data(), values.rows(), values.cols()) = values.cast<float>();
  return result;
}

struct JointWeights {
  std::vector<unsigned short> joints;  // 4 a vertex
  std::vector<float> weights;          // 4 a vertex, heaviest first
};

/// The embedding as glTF wants it: in float the weights still sum to 1, and a joint of no weight is joint 0.
JointWeights joint_weights(const retarget::Embedding& embedding) {
  JointWeights result;
  for (Eigen::Index v = 0; v < embedding.weights.cols(); ++v) {
    std::array<int, 4> order{0, 1, 2, 3};
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return embedding.weights(a, v) > embedding.weights(b, v); });
    std::array<float, 4> weights{};
    for (std::size_t k = 1; k < 4; ++k) weights[k] = static_cast<float>(std::max(0.0, embedding.weights(order[k], v)));
    weights[0] = 1.0f - (weights[1] + (weights[2] + weights[3]));
    for (std::size_t k = 0; k < 4; ++k) {
      result.joints.push_back(weights[k] > 0 ? static_cast<unsigned short>(embedding.nodes(order[k], v)) : 0);
      result.weights.push_back(weights[k]);
    }
  }
  return result;
}

void add_positions(BufferWriter& buffer, const Eigen::Matrix3Xd& vertices, tinygltf::Primitive& primitive) {
  const std::vector<float> positions = floats(vertices);
  const int position =
      buffer.array(positions, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
  buffer.set_bounds(position, positions);
  primitive.attributes["POSITION"] = position;
}

void add_joints(BufferWriter& buffer, const retarget::Embedding& embedding, tinygltf::Primitive& primitive) {
  const JointWeights bound = joint_weights(embedding);
  primitive.attributes["JOINTS_0"] =
      buffer.array(bound.joints, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4);
  primitive.attributes["WEIGHTS_0"] =
      buffer.array(bound.weights, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC4);
}

/// A property of the vertices; nothing where it has no columns.
void add_property(BufferWriter& buffer, const std::string& name, const Eigen::Ref<const Eigen::MatrixXd>& values, int type,
                  std::map<std::string, int>& properties) {
  if (values.cols() == 0) return;
  properties[name] = buffer.array(floats(values), TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT, type);
}

void add_triangles(BufferWriter& buffer, const Eigen::Matrix3Xi& triangles, tinygltf::Primitive& primitive) {
  const std::vector<unsigned> corners(triangles.data(), triangles.data() + triangles.size());
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.indices = buffer.array(corners, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                   TINYGLTF_TYPE_SCALAR);
}

tinygltf::Primitive part_of_skin(BufferWriter& buffer, const EmbeddedSkin& skin, const Appearance::Part& part) {
  tinygltf::Primitive primitive;
  retarget::Embedding embedding;
  embedding.nodes = skin.embedding.nodes(Eigen::all, part.vertices);
  embedding.weights = skin.embedding.weights(Eigen::all, part.vertices);
  add_positions(buffer, skin.vertices(Eigen::all, part.vertices), primitive);
  add_property(buffer, "NORMAL", part.normals, TINYGLTF_TYPE_VEC3, primitive.attributes);
  add_joints(buffer, embedding, primitive);
  add_property(buffer, "TANGENT", part.tangents, TINYGLTF_TYPE_VEC4, primitive.attributes);
  for (std::size_t set = 0; set < part.uvs.size(); ++set)
    add_property(buffer, "TEXCOORD_" + std::to_string(set), part.uvs[set], TINYGLTF_TYPE_VEC2, primitive.attributes);
  add_property(buffer, "COLOR_0", part.colours, TINYGLTF_TYPE_VEC4, primitive.attributes);
  add_triangles(buffer, part.triangles, primitive);
  return primitive;
}

/// What skin without a material looks like.
tinygltf::Material plain_material(const GltfOptions& options) {
  tinygltf::Material material;
  material.name = options.name;
  material.pbrMetallicRoughness.baseColorFactor.assign(options.colour.begin(), options.colour.end());
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 0.7;
  material.doubleSided = true;
  return material;
}

void add_materials(tinygltf::Model& model, BufferWriter& buffer, const EmbeddedSkin& skin) {
  if (skin.appearance == nullptr) return;
  std::vector<int> image_views;
  for (const Image& image : skin.appearance->images)
    image_views.push_back(buffer.view(std::vector<char>(image.bytes.begin(), image.bytes.end()), 0));
  write_materials(*skin.appearance, image_views, model);
}

void add_mesh(tinygltf::Model& model, BufferWriter& buffer, const EmbeddedSkin& skin,
              const std::vector<Appearance::Part>& parts, const GltfOptions& options) {
  tinygltf::Mesh mesh;
  mesh.name = options.name;
  add_materials(model, buffer, skin);
  int plain = -1;
  for (const Appearance::Part& part : parts) {
    if (part.material < 0 && plain < 0) {
      plain = static_cast<int>(model.materials.size());
      tinygltf::Material material = plain_material(options);
      // Vertex colours are factors.
      if (part.colours.size() > 0) material.pbrMetallicRoughness.baseColorFactor.assign(4, 1);
      model.materials.push_back(std::move(material));
    }
    mesh.primitives.push_back(part_of_skin(buffer, skin, part));
    mesh.primitives.back().material = part.material < 0 ? plain : part.material;
  }
  model.meshes.push_back(std::move(mesh));
}

/// Scene nodes: 0 is the mesh, 1 the still root of the skeleton, 2 + n the joint of control node n.
void add_skeleton(tinygltf::Model& model, BufferWriter& buffer, const retarget::ControlMesh& body,
                  const GltfOptions& options) {
  tinygltf::Node mesh_node;
  mesh_node.name = options.name;
  mesh_node.mesh = 0;
  mesh_node.skin = 0;
  tinygltf::Node root;
  root.name = options.name + " nodes";
  if (!options.place.isZero(0)) root.translation = {options.place.x(), options.place.y(), options.place.z()};
  tinygltf::Skin skin;
  skin.name = options.name;
  skin.skeleton = 1;
  std::vector<tinygltf::Node> joints(static_cast<std::size_t>(body.node_count()));
  std::vector<float> inverse_binds;
  for (int n = 0; n < body.node_count(); ++n) {
    const Eigen::Vector3d place = body.nodes.col(n);
    tinygltf::Node& joint = joints[static_cast<std::size_t>(n)];
    joint.name = "node " + std::to_string(n);
    joint.translation = {place.x(), place.y(), place.z()};
    root.children.push_back(2 + n);
    skin.joints.push_back(2 + n);
    Eigen::Matrix4f inverse_bind = Eigen::Matrix4f::Identity();
    inverse_bind.topRightCorner<3, 1>() = -place.cast<float>();
    inverse_binds.insert(inverse_binds.end(), inverse_bind.data(), inverse_bind.data() + inverse_bind.size());
  }
  skin.inverseBindMatrices = buffer.array(inverse_binds, 0, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_MAT4);
  model.skins.push_back(skin);
  model.nodes = {mesh_node, root};
  model.nodes.insert(model.nodes.end(), joints.begin(), joints.end());
}

tinygltf::AnimationChannel channel(int sampler, int target, const char* path) {
  tinygltf::AnimationChannel result;
  result.sampler = sampler;
  result.target_node = target;
  result.target_path = path;
  return result;
}

/// Morph targets and, behind them, normals that bend with the body: targets of the mesh and their weights over time. Those of
/// normals tell of positions too, that these stay: three.js 0.170 cannot draw targets without.
void add_targets(tinygltf::Model& model, BufferWriter& buffer, const std::vector<Appearance::Part>& parts,
                 const PlayedMorphs& morphs, const MovingNormals& normals, int time, tinygltf::Animation& animation) {
  const std::size_t shapes = morphs.shapes.size(), count = shapes + normals.targets.size();
  if (count == 0) return;
  tinygltf::Mesh& mesh = model.meshes.front();
  for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
    const std::vector<float> nowhere(static_cast<std::size_t>(3 * parts[p].vertices.size()), 0.0f);
    const int still = buffer.array(nowhere, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
    buffer.set_bounds(still, nowhere);
    for (std::size_t k = 0; k < shapes; ++k) {
      const Eigen::Matrix3Xd offsets = morphs.shapes[k](Eigen::all, parts[p].vertices);
      tinygltf::Primitive target;
      add_positions(buffer, offsets, target);
      if (!normals.of_shapes.empty()) {
        add_property(buffer, "NORMAL", normals.of_shapes[k][p], TINYGLTF_TYPE_VEC3, target.attributes);
      }
      mesh.primitives[p].targets.push_back(target.attributes);
    }
    for (const std::vector<Eigen::Matrix3Xd>& target : normals.targets) {
      std::map<std::string, int>& properties = mesh.primitives[p].targets.emplace_back();
      properties["POSITION"] = still;
      add_property(buffer, "NORMAL", target[p], TINYGLTF_TYPE_VEC3, properties);
    }
  }
  mesh.weights.assign(count, 0.0);
  Eigen::MatrixXd weights(static_cast<Eigen::Index>(count), std::max(morphs.weights.cols(), normals.weights.cols()));
  weights.topRows(morphs.weights.rows()) = morphs.weights;
  weights.bottomRows(normals.weights.rows()) = normals.weights;
  tinygltf::AnimationSampler sampler;
  sampler.input = time;
  sampler.output = buffer.array(floats(weights), 0, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_SCALAR);
  sampler.interpolation = "LINEAR";
  animation.samplers.push_back(sampler);
  animation.channels.push_back(channel(static_cast<int>(animation.samplers.size()) - 1, 0, "weights"));
  if (shapes == 0) return;
  tinygltf::Value::Array names;
  for (const std::string& name : morphs.names) names.emplace_back(name);
  for (std::size_t k = 0; k < normals.targets.size(); ++k) names.emplace_back("normals " + std::to_string(k + 1));
  mesh.extras = tinygltf::Value(tinygltf::Value::Object{{"targetNames", tinygltf::Value(names)}});
}

void add_animation(tinygltf::Model& model, BufferWriter& buffer, const PlayedSkin& skin,
                   const std::vector<Appearance::Part>& parts, const GltfOptions& options) {
  const retarget::Motion& motion = skin.motion();
  const auto frames = static_cast<std::size_t>(motion.count());
  std::vector<float> times(frames);
  for (std::size_t f = 0; f < frames; ++f) times[f] = static_cast<float>(static_cast<double>(f) / motion.rate_hz);
  const int time = buffer.array(times, 0, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_SCALAR);
  buffer.set_bounds(time, times);

  std::vector<float> turns;
  for (const Eigen::Quaterniond& turn : skin.turns()) {
    for (double part : turn.coeffs()) turns.push_back(static_cast<float>(part));  // x, y, z, w, as glTF has it
  }
  std::vector<float> paths;  // joint by joint, so that each joint's keys lie together
  paths.reserve(static_cast<std::size_t>(motion.frames.size()));
  for (Eigen::Index n = 0; n < motion.frames.rows() / 3; ++n) {
    const std::vector<float> path = floats(motion.frames.middleRows<3>(3 * n));
    paths.insert(paths.end(), path.begin(), path.end());
  }

  tinygltf::Animation animation;
  animation.name = options.name;
  const auto add_sampler = [&](int output) {
    tinygltf::AnimationSampler sampler;
    sampler.input = time;
    sampler.output = output;
    sampler.interpolation = "LINEAR";
    animation.samplers.push_back(sampler);
    return static_cast<int>(animation.samplers.size()) - 1;
  };
  const int turning = add_sampler(buffer.array(turns, 0, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC4));
  const int path_view = buffer.view(paths, 0);
  for (int n = 0; n < motion.frames.rows() / 3; ++n) {
    const std::size_t offset = static_cast<std::size_t>(n) * frames * 3 * sizeof(float);
    const int path = buffer.accessor(path_view, offset, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, frames);
    animation.channels.push_back(channel(add_sampler(path), 2 + n, "translation"));
    animation.channels.push_back(channel(turning, 2 + n, "rotation"));
  }
  const PlayedMorphs& morphs = skin.morphs();
  const SkinCourse course{skin.carried_in_bind_pose(), [&](Eigen::Index f) { return skin.carried_at(f); }, motion.count()};
  add_targets(model, buffer, parts, morphs, fit_normals(parts, course, skin.turns(), morphs.shapes, morphs.weights), time,
              animation);
  model.animations.push_back(animation);
}

}  // namespace

void write_skinned_glb(const std::filesystem::path& path, const EmbeddedSkin& skin, const retarget::ControlMesh& body,
                       const Eigen::Ref<const Eigen::VectorXd>& mass, const retarget::Motion& motion,
                       const GltfOptions& options) {
  constexpr int kMostJoints = std::numeric_limits<unsigned short>::max() + 1;
  if (body.node_count() > kMostJoints) {
    throw Error(path.string(), "control mesh",
                std::to_string(body.node_count()) + " nodes are more than glTF can number as joints",
                "Ask for at most " + std::to_string(kMostJoints) + " with --nodes");
  }

  tinygltf::Model model;
  model.asset.version = "2.0";
  model.asset.generator = "hydrostat";
  BufferWriter buffer(model);
  const std::vector<Appearance::Part> parts = parts_of(skin);
  add_mesh(model, buffer, skin, parts, options);
  add_skeleton(model, buffer, body, options);
  add_animation(model, buffer, PlayedSkin(skin, body, mass, motion), parts, options);
  tinygltf::Scene scene;
  scene.name = options.name;
  scene.nodes = {0, 1};
  model.scenes.push_back(scene);
  model.defaultScene = 0;

  std::ostringstream stream;
  tinygltf::TinyGLTF writer;
  writer.WriteGltfSceneToStream(&model, stream, /*prettyPrint=*/false, /*writeBinary=*/true);
  write_file(path, stream.view());
}

}  // namespace hydrostat::io

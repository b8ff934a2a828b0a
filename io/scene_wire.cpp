#include "io/scene_wire.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace hydrostat::io {
namespace {

constexpr std::uint64_t kMagic = 0x344e4353'4f524459;  // begins an answer; another for each form of it
constexpr std::uint64_t kEnd = 0x2e646e65'2e646e65;    // ends it
constexpr double kLargestNumber = 1e12;
constexpr std::size_t kMostSceneNodes = 10000, kMostClips = 2000;  // what follows takes time that grows faster than they do

class Writer {
 public:
  static constexpr bool kReads = false;
  template <typename Number>
  void number(const Number& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(Number));
  }
  void letters(std::string& text) { bytes_ += text; }
  std::size_t count(std::size_t actual, std::size_t /*bytes_each*/) {
    number(static_cast<std::uint64_t>(actual));
    return actual;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  static constexpr bool kReads = true;
  explicit Reader(std::string_view bytes) : left_(bytes) {}
  template <typename Number>
  void number(Number& value) {
    if (left_.size() < sizeof(Number)) throw std::runtime_error("the answer ends too early");
    std::memcpy(&value, left_.data(), sizeof(Number));
    left_.remove_prefix(sizeof(Number));
    if constexpr (std::is_floating_point_v<Number>) {
      // Below any size, time or weight that means something; a deep chain of such factors would overflow.
      if (!(std::abs(value) <= kLargestNumber))
        throw std::runtime_error("it holds a number that is not finite, or above 1e12");
    }
  }
  void letters(std::string& text) {
    std::memcpy(text.data(), left_.data(), text.size());  // as many are left: `count` has seen to that
    left_.remove_prefix(text.size());
  }
  std::size_t count(std::size_t /*actual*/, std::size_t bytes_each) {
    std::uint64_t announced = 0;
    number(announced);
    if (announced > left_.size() / bytes_each) throw std::runtime_error("a list is announced longer than the answer");
    return static_cast<std::size_t>(announced);
  }
  bool is_empty() const { return left_.empty(); }

 private:
  std::string_view left_;
};

// One description of each struct serves both directions.
template <typename Wire>
void pass(Wire& wire, double& value) {
  wire.number(value);
}
template <typename Wire>
void pass(Wire& wire, int& value) {
  wire.number(value);
}
template <typename Wire>
void pass(Wire& wire, bool& value) {
  std::uint8_t byte = value ? 1 : 0;
  wire.number(byte);
  value = byte != 0;
}
template <typename Wire, typename Enum>
void pass_enum(Wire& wire, Enum& value, Enum last) {
  auto byte = static_cast<std::uint8_t>(value);
  wire.number(byte);
  if (byte > static_cast<std::uint8_t>(last)) throw std::runtime_error("a choice is out of its range");
  value = static_cast<Enum>(byte);
}
template <typename Wire>
void pass(Wire& wire, std::string& text) {
  text.resize(wire.count(text.size(), 1));
  wire.letters(text);
}
template <typename Wire, typename Scalar, int Rows, int Cols>
void pass(Wire& wire, Eigen::Matrix<Scalar, Rows, Cols>& matrix) {
  const std::size_t rows = wire.count(static_cast<std::size_t>(matrix.rows()), Cols == 1 ? sizeof(Scalar) : 1);
  const std::size_t cols =
      wire.count(static_cast<std::size_t>(matrix.cols()), sizeof(Scalar) * std::max<std::size_t>(rows, 1));
  // A column may have any number of rows.
  if ((Rows != Eigen::Dynamic && rows != static_cast<std::size_t>(Rows)) || (rows > 4 && Cols != 1) ||
      (Cols != Eigen::Dynamic && cols != static_cast<std::size_t>(Cols))) {
    throw std::runtime_error("a matrix has the wrong size");
  }
  matrix.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
  for (Eigen::Index i = 0; i < matrix.size(); ++i) pass(wire, matrix.data()[i]);
}
template <typename Wire>
void pass(Wire& wire, Eigen::Affine3d& transform) {
  Eigen::Matrix<double, 3, 4> rows = transform.affine();
  pass(wire, rows);
  transform.setIdentity();
  transform.affine() = rows;
}
template <typename Wire>
void pass(Wire& wire, SceneMesh::Weight& weight) {
  pass(wire, weight.vertex);
  pass(wire, weight.weight);
}
template <typename Wire, typename Item>
void pass(Wire& wire, std::vector<Item>& items) {
  items.resize(wire.count(items.size(), 8));  // no item takes fewer than 8 bytes
  for (Item& item : items) pass(wire, item);
}
template <typename Wire>
void pass(Wire& wire, Track& track) {
  pass_enum(wire, track.interpolation, Interpolation::kCubic);
  pass(wire, track.times);
  pass(wire, track.values);
  pass(wire, track.in_tangents);
  pass(wire, track.out_tangents);
}
template <typename Wire>
void pass(Wire& wire, Channel& channel) {
  pass(wire, channel.node);
  pass(wire, channel.part);
  pass(wire, channel.translation);
  pass(wire, channel.rotation);
  pass(wire, channel.scale);
}
template <typename Wire>
void pass(Wire& wire, MorphChannel& channel) {
  pass(wire, channel.node);
  pass(wire, channel.target);
  pass(wire, channel.weight);
}
template <typename Wire>
void pass(Wire& wire, SceneMesh::Morph& morph) {
  pass(wire, morph.name);
  pass(wire, morph.weight);
  pass(wire, morph.vertices);
  pass(wire, morph.offsets);
}
template <typename Wire>
void pass(Wire& wire, SceneClip& clip) {
  pass(wire, clip.name);
  pass(wire, clip.duration_s);
  pass(wire, clip.channels);
  pass(wire, clip.morphs);
}
template <typename Wire>
void pass(Wire& wire, SceneNode& node) {
  pass(wire, node.name);
  pass(wire, node.parent);
  pass(wire, node.parts);
  pass_enum(wire, node.inheritance, ScaleInheritance::kCompensated);
  pass(wire, node.holds_mesh);
  pass(wire, node.is_joint);
}
template <typename Wire>
void pass(Wire& wire, SceneMesh::Joint& joint) {
  pass(wire, joint.node);
  pass(wire, joint.inverse_bind_matrix);
  pass(wire, joint.weights);
}
template <typename Wire>
void pass(Wire& wire, SceneMesh& mesh) {
  pass(wire, mesh.name);
  pass(wire, mesh.node);
  pass(wire, mesh.vertices);
  pass(wire, mesh.triangles);
  pass(wire, mesh.joints);
  pass(wire, mesh.triangle_materials);
  pass(wire, mesh.normals);
  pass(wire, mesh.uvs);
  pass(wire, mesh.colours);
  pass(wire, mesh.morphs);
}
template <typename Wire>
void pass(Wire& wire, Image& image) {
  pass(wire, image.name);
  pass(wire, image.file);
  pass(wire, image.bytes);
}
template <typename Wire>
void pass(Wire& wire, TextureMap& map) {
  for (int* number : {&map.image, &map.uv_set, &map.wrap_u, &map.wrap_v, &map.magnify_filter, &map.minify_filter})
    pass(wire, *number);
  pass(wire, map.strength);
  pass(wire, map.offset);
  pass(wire, map.scale);
  pass(wire, map.turn);
}
template <typename Wire>
void pass(Wire& wire, Material& material) {
  pass(wire, material.name);
  pass(wire, material.base_colour);
  pass(wire, material.metallic);
  pass(wire, material.roughness);
  pass(wire, material.emissive);
  pass_enum(wire, material.alpha_mode, AlphaMode::kBlend);
  pass(wire, material.alpha_cutoff);
  pass(wire, material.double_sided);
  pass(wire, material.unlit);
  for (TextureMap* map : maps_of(material)) pass(wire, *map);
}
template <typename Wire>
void pass(Wire& wire, Scene& scene) {
  pass(wire, scene.format);
  pass(wire, scene.metres_per_unit);
  pass(wire, scene.up);
  pass(wire, scene.to_y_up);
  pass(wire, scene.nodes);
  pass(wire, scene.meshes);
  pass(wire, scene.clips);
  pass(wire, scene.materials);
  pass(wire, scene.images);
  pass(wire, scene.warnings);
  pass(wire, scene.files_confined);
  pass(wire, scene.network_confined);
}

void require(bool fits, const char* what) {
  if (!fits) throw std::runtime_error(what);
}

bool is_index(int value, std::size_t count) { return value >= 0 && static_cast<std::size_t>(value) < count; }

void check_track(const Track& track, Eigen::Index rows) {
  const auto keys = static_cast<Eigen::Index>(track.times.size());
  if (keys == 0) return;
  require(track.values.rows() == rows && track.values.cols() == keys, "a track's values do not fit its times");
  for (std::size_t k = 1; k < track.times.size(); ++k)
    require(track.times[k] > track.times[k - 1], "key times do not ascend");
  if (track.interpolation != Interpolation::kCubic) return;
  require(track.in_tangents.rows() == rows && track.in_tangents.cols() == keys && track.out_tangents.rows() == rows &&
              track.out_tangents.cols() == keys,
          "a track's tangents do not fit its times");
}

void check_looks(const SceneMesh& mesh, std::size_t materials) {
  const auto fits = [&](Eigen::Index count) { return count == 0 || count == mesh.vertices.cols(); };
  require(mesh.triangle_materials.size() == 0 || mesh.triangle_materials.size() == mesh.triangles.cols(),
          "a mesh has not as many materials as triangles");
  for (const int material : mesh.triangle_materials)
    require(material == -1 || is_index(material, materials), "a mesh wears a material that is not there");
  require(fits(mesh.normals.cols()) && fits(mesh.colours.cols()), "a mesh's normals or colours do not fit its vertices");
  for (const Eigen::Matrix2Xd& places : mesh.uvs) require(fits(places.cols()), "a mesh's places in images do not fit its vertices");
}

/// Each vertex once, in order, so that nobody need look for repetitions.
void check_morphs(const SceneMesh& mesh) {
  for (const SceneMesh::Morph& morph : mesh.morphs) {
    require(morph.vertices.size() == morph.offsets.cols(), "a morph target has not as many offsets as vertices");
    for (Eigen::Index i = 0; i < morph.vertices.size(); ++i) {
      require(is_index(morph.vertices[i], static_cast<std::size_t>(mesh.vertices.cols())) &&
                  (i == 0 || morph.vertices[i] > morph.vertices[i - 1]),
              "a morph target moves a vertex that is not there");
    }
  }
}

void check_material(const Material& material, std::size_t images) {
  const auto is_share = [](double value) { return value >= 0 && value <= 1; };
  require(is_share(material.metallic) && is_share(material.roughness) && material.alpha_cutoff >= 0 &&
              material.base_colour.minCoeff() >= 0 && material.base_colour.maxCoeff() <= 1 &&
              material.emissive.minCoeff() >= 0,
          "a material's numbers are out of their range");
  for (const TextureMap* map : maps_of(material)) {
    require(map->image == -1 || is_index(map->image, images), "a material shows an image that is not there");
    require(map->uv_set >= 0, "a material takes places in images that are not there");
  }
}

/// Throws std::runtime_error where an index points nowhere or sizes disagree.
void check(const Scene& scene) {
  require(scene.metres_per_unit > 0, "the unit is not positive");
  require(scene.nodes.size() <= kMostSceneNodes, "it has more than 10,000 nodes");
  require(scene.clips.size() <= kMostClips, "it has more than 2,000 clips");
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    const SceneNode& node = scene.nodes[n];
    require(node.parent >= -1 && node.parent < static_cast<int>(n), "a node comes before its parent");
    require(!node.parts.empty(), "a node has no transform");
  }
  for (const SceneMesh& mesh : scene.meshes) {
    const auto vertices = static_cast<std::size_t>(mesh.vertices.cols());
    require(is_index(mesh.node, scene.nodes.size()), "a mesh hangs on no node");
    for (Eigen::Index i = 0; i < mesh.triangles.size(); ++i) {
      require(is_index(mesh.triangles.data()[i], vertices), "a triangle names a vertex that is not there");
    }
    check_looks(mesh, scene.materials.size());
    check_morphs(mesh);
    for (const SceneMesh::Joint& joint : mesh.joints) {
      require(is_index(joint.node, scene.nodes.size()), "a skin names a node that is not there");
      for (const SceneMesh::Weight& weight : joint.weights) {
        require(is_index(weight.vertex, vertices) && weight.weight >= 0, "a skin weight is out of its range");
      }
    }
  }
  for (const Material& material : scene.materials) check_material(material, scene.images.size());
  for (const SceneClip& clip : scene.clips) {
    for (const Channel& channel : clip.channels) {
      require(is_index(channel.node, scene.nodes.size()), "a channel moves no node");
      require(is_index(channel.part, scene.nodes[static_cast<std::size_t>(channel.node)].parts.size()),
              "a channel moves no part");
      check_track(channel.translation, 3);
      check_track(channel.rotation, 4);
      check_track(channel.scale, 3);
    }
    for (const MorphChannel& channel : clip.morphs) {
      require(is_index(channel.node, scene.nodes.size()) && channel.target >= 0 && !channel.weight.times.empty(),
              "a channel moves no morph target");
      check_track(channel.weight, 1);
    }
  }
}

}  // namespace

std::string to_bytes(const WorkerAnswer& answer) {
  Writer writer;
  writer.number(kMagic);
  bool is_scene = std::holds_alternative<Scene>(answer);
  pass(writer, is_scene);
  if (is_scene) {
    Scene scene = std::get<Scene>(answer);
    pass(writer, scene);
  } else {
    const Error& error = std::get<Error>(answer);
    for (std::string text : {error.file, error.where, std::string(error.what()), error.mend}) pass(writer, text);
  }
  writer.number(kEnd);
  return writer.take();
}

WorkerAnswer from_bytes(std::string_view bytes) {
  Reader reader(bytes);
  std::uint64_t word = 0;
  reader.number(word);
  require(word == kMagic, "it is no answer of ours");
  const auto finish = [&] {
    reader.number(word);
    require(word == kEnd && reader.is_empty(), "the answer does not end where it should");
  };
  bool is_scene = false;
  pass(reader, is_scene);
  if (is_scene) {
    Scene scene;
    pass(reader, scene);
    finish();
    check(scene);
    return scene;
  }
  std::string file, where, what, mend;
  for (std::string* text : {&file, &where, &what, &mend}) pass(reader, *text);
  finish();
  return Error(file, where, what, mend);
}

}  // namespace hydrostat::io

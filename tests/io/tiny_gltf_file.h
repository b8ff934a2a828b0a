#pragma once

#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace hydrostat::io {

/// Collects binary data and the JSON that describes it.
struct GltfBuffer {
  std::string bytes;
  nlohmann::json views = nlohmann::json::array(), accessors = nlohmann::json::array();

  template <typename Number>
  int add(const std::vector<Number>& numbers, int component_type, const char* type, std::size_t width,
          bool normalised = false) {
    views.push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", numbers.size() * sizeof(Number)}});
    bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
    bytes.resize((bytes.size() + 3) / 4 * 4);
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", component_type},
                         {"count", numbers.size() / width},
                         {"type", type},
                         {"normalized", normalised}});
    return static_cast<int>(accessors.size()) - 1;
  }
};

/// A strip of skin along y with two bones, "low" at the origin and "high" above it at y = 1; "high" turns about z.
///
///   y=2  4---5
///        | / |   high
///   y=1  2---3
///        | / |   low
///   y=0  0---1
///
/// What a field says goes into the file as it is, sound or not.
struct TinyGltf {
  std::string interpolation = "LINEAR";
  std::vector<float> key_times{0, 1};                 // [s]
  std::vector<float> rotations{0, 0, 0,           1,  // x y z w of each key
                               0, 0, 0.70710678f, 0.70710678f};
  std::vector<float> weights_of_high{0, 0, 1, 1, 1, 1};  // of each vertex; "low" has the rest
  bool weights_as_bytes = false;
  std::vector<int> vertices_without_weights;
  bool with_bind_matrices = true;
  bool with_skin = true;
  float scale_of_root = 1;                                              // of the node above both bones
  std::function<void(nlohmann::json& file, GltfBuffer& buffer)> amend;  // changes the file before it is written

  /// Writes `directory`/tiny.gltf and tiny.bin; returns the path of the former.
  std::string write(const std::string& directory) const;
};

inline std::string TinyGltf::write(const std::string& directory) const {
  constexpr int kByte = 5121, kFloat = 5126;
  using Json = nlohmann::json;
  GltfBuffer buffer;
  std::vector<std::uint8_t> joints;
  std::vector<float> weights;
  for (const float high : weights_of_high) {
    joints.insert(joints.end(), {0, 1, 0, 0});
    weights.insert(weights.end(), {1 - high, high, 0, 0});
  }
  for (const int v : vertices_without_weights)
    weights[4 * static_cast<std::size_t>(v)] = weights[4 * static_cast<std::size_t>(v) + 1] = 0;
  std::vector<std::uint8_t> bytes;
  for (const float weight : weights) bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * weight)));
  Json attributes;
  attributes["POSITION"] = buffer.add(
      std::vector<float>{-0.1f, 0, 0, 0.1f, 0, 0, -0.1f, 1, 0, 0.1f, 1, 0, -0.1f, 2, 0, 0.1f, 2, 0}, kFloat, "VEC3", 3);
  attributes["JOINTS_0"] = buffer.add(joints, kByte, "VEC4", 4);
  attributes["WEIGHTS_0"] =
      weights_as_bytes ? buffer.add(bytes, kByte, "VEC4", 4, true) : buffer.add(weights, kFloat, "VEC4", 4);
  const int indices = buffer.add(std::vector<std::uint8_t>{0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4}, kByte, "SCALAR", 1);
  const int binds = buffer.add(
      std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1},
      kFloat, "MAT4", 16);
  const int input = buffer.add(key_times, kFloat, "SCALAR", 1), output = buffer.add(rotations, kFloat, "VEC4", 4);
  Json skin{{"joints", {1, 2}}};
  if (with_bind_matrices) skin["inverseBindMatrices"] = binds;
  Json body{{"name", "body"}, {"mesh", 0}};
  if (with_skin) body["skin"] = 0;
  Json file{{"asset", {{"version", "2.0"}}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0, 3}}}}},
            {"nodes",
             {{{"name", "root"}, {"children", {1}}, {"scale", {scale_of_root, scale_of_root, scale_of_root}}},
              {{"name", "low"}, {"children", {2}}},
              {{"name", "high"}, {"translation", {0, 1, 0}}},
              body}},
            {"meshes", {{{"name", "strip"}, {"primitives", {{{"attributes", attributes}, {"indices", indices}}}}}}},
            {"skins", {skin}},
            {"animations",
             {{{"name", "bow"},
               {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}},
               {"channels", {{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}}}}}}}};
  if (amend) amend(file, buffer);
  file["buffers"] = {{{"uri", "tiny.bin"}, {"byteLength", buffer.bytes.size()}}};
  file["bufferViews"] = buffer.views;
  file["accessors"] = buffer.accessors;
  std::ofstream(directory + "/tiny.bin", std::ios::binary) << buffer.bytes;
  std::ofstream(directory + "/tiny.gltf") << file.dump();
  return directory + "/tiny.gltf";
}

}  // namespace hydrostat::io

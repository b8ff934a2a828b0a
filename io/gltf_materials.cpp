#include "io/gltf_materials.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "io/images.h"

namespace hydrostat::io {
namespace {

constexpr const char *kTransform = "KHR_texture_transform", *kUnlit = "KHR_materials_unlit",
                     *kStrength = "KHR_materials_emissive_strength";
constexpr double kLargest = 1e6;  // of what has no bounds

double bounded(double value, double least, double most, double otherwise) {
  return std::isfinite(value) ? std::clamp(value, least, most) : otherwise;
}

double number(const tinygltf::Value& value, double otherwise) {
  return value.IsNumber() ? bounded(value.GetNumberAsDouble(), -kLargest, kLargest, otherwise) : otherwise;
}

double number(const tinygltf::ExtensionMap& extensions, const char* extension, const char* key, double otherwise) {
  const auto found = extensions.find(extension);
  return found != extensions.end() && found->second.Has(key) ? number(found->second.Get(key), otherwise) : otherwise;
}

Eigen::Vector2d pair(const tinygltf::Value& parent, const char* key, double otherwise) {
  Eigen::Vector2d result(otherwise, otherwise);
  const tinygltf::Value& value = parent.Get(key);
  if (!value.IsArray() || value.ArrayLen() != 2) return result;
  for (int k = 0; k < 2; ++k) result[k] = number(value.Get(k), otherwise);
  return result;
}

template <typename Numbers>
void take(const std::vector<double>& told, double most, Numbers& numbers) {
  if (told.size() != static_cast<std::size_t>(numbers.size())) return;
  for (std::size_t k = 0; k < told.size(); ++k) {
    double& kept = numbers[static_cast<Eigen::Index>(k)];
    kept = bounded(told[k], 0, most, kept);
  }
}

bool is_wrap(int value) { return value == 33071 || value == 33648 || value == 10497; }
bool is_filter(int value) { return value == 9728 || value == 9729; }
bool is_mip_filter(int value) { return is_filter(value) || (value >= 9984 && value <= 9987); }

/// `Info` is any of tinygltf's three kinds of references to a texture.
template <typename Info>
TextureMap read_map(const tinygltf::Model& model, const Info& info) {
  TextureMap map;
  if (info.index < 0 || static_cast<std::size_t>(info.index) >= model.textures.size()) return map;
  const tinygltf::Texture& texture = model.textures[static_cast<std::size_t>(info.index)];
  if (texture.source < 0 || static_cast<std::size_t>(texture.source) >= model.images.size()) return map;
  map.image = texture.source;
  map.uv_set = std::max(0, info.texCoord);
  if (texture.sampler >= 0 && static_cast<std::size_t>(texture.sampler) < model.samplers.size()) {
    const tinygltf::Sampler& sampler = model.samplers[static_cast<std::size_t>(texture.sampler)];
    if (is_wrap(sampler.wrapS)) map.wrap_u = sampler.wrapS;
    if (is_wrap(sampler.wrapT)) map.wrap_v = sampler.wrapT;
    if (is_filter(sampler.magFilter)) map.magnify_filter = sampler.magFilter;
    if (is_mip_filter(sampler.minFilter)) map.minify_filter = sampler.minFilter;
  }
  const auto moved = info.extensions.find(kTransform);
  if (moved == info.extensions.end()) return map;
  map.offset = pair(moved->second, "offset", 0);
  map.scale = pair(moved->second, "scale", 1);
  map.turn = number(info.extensions, kTransform, "rotation", 0);
  map.uv_set = std::max(0, static_cast<int>(number(info.extensions, kTransform, "texCoord", map.uv_set)));
  return map;
}

Material read_material(const tinygltf::Model& model, const tinygltf::Material& theirs) {
  Material ours;
  ours.name = theirs.name;
  const tinygltf::PbrMetallicRoughness& surface = theirs.pbrMetallicRoughness;
  take(surface.baseColorFactor, 1, ours.base_colour);
  take(theirs.emissiveFactor, 1, ours.emissive);
  ours.emissive *= std::max(0.0, number(theirs.extensions, kStrength, "emissiveStrength", 1));
  ours.metallic = bounded(surface.metallicFactor, 0, 1, 1);
  ours.roughness = bounded(surface.roughnessFactor, 0, 1, 1);
  ours.alpha_mode = theirs.alphaMode == "MASK"    ? AlphaMode::kMask
                    : theirs.alphaMode == "BLEND" ? AlphaMode::kBlend
                                                  : AlphaMode::kOpaque;
  ours.alpha_cutoff = bounded(theirs.alphaCutoff, 0, kLargest, 0.5);
  ours.double_sided = theirs.doubleSided;
  ours.unlit = theirs.extensions.contains(kUnlit);
  ours.base_colour_map = read_map(model, surface.baseColorTexture);
  ours.metallic_roughness_map = read_map(model, surface.metallicRoughnessTexture);
  ours.normal_map = read_map(model, theirs.normalTexture);
  ours.normal_map.strength = bounded(theirs.normalTexture.scale, -kLargest, kLargest, 1);
  ours.occlusion_map = read_map(model, theirs.occlusionTexture);
  ours.occlusion_map.strength = bounded(theirs.occlusionTexture.strength, 0, 1, 1);
  ours.emissive_map = read_map(model, theirs.emissiveTexture);
  return ours;
}

/// "%20" and its like.
std::string percent_decoded(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool coded = uri[i] == '%' && i + 2 < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[i + 1])) &&
                       std::isxdigit(static_cast<unsigned char>(uri[i + 2]));
    text += coded ? static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16)) : uri[i];
    if (coded) i += 2;
  }
  return text;
}

/// Foreign names may hold bytes that are no UTF-8; they become U+FFFD.
std::string sound_text(const std::string& name) {
  return nlohmann::json::parse(nlohmann::json(name).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

void use_extension(tinygltf::Model& model, const char* name) {
  std::vector<std::string>& used = model.extensionsUsed;
  if (std::find(used.begin(), used.end(), name) == used.end()) used.emplace_back(name);
}

tinygltf::Value two_numbers(const Eigen::Vector2d& values) {
  return tinygltf::Value(tinygltf::Value::Array{tinygltf::Value(values.x()), tinygltf::Value(values.y())});
}

/// Writes maps, each texture and sampler once.
class MapWriter {
 public:
  explicit MapWriter(tinygltf::Model& model) : model_(model) {}

  template <typename Info>
  void write(const TextureMap& map, Info& info) {
    if (map.image < 0) return;
    info.index = texture(map);
    info.texCoord = map.uv_set;
    if (map.offset.isZero(0) && map.turn == 0 && map.scale == Eigen::Vector2d::Ones()) return;
    use_extension(model_, kTransform);
    info.extensions[kTransform] = tinygltf::Value(tinygltf::Value::Object{
        {"offset", two_numbers(map.offset)}, {"rotation", tinygltf::Value(map.turn)}, {"scale", two_numbers(map.scale)}});
  }

 private:
  int texture(const TextureMap& map) {
    const auto [place, is_new] = textures_.try_emplace({map.image, sampler(map)}, static_cast<int>(model_.textures.size()));
    if (is_new) {
      tinygltf::Texture texture;
      texture.source = map.image;
      texture.sampler = place->first.second;
      model_.textures.push_back(texture);
    }
    return place->second;
  }
  int sampler(const TextureMap& map) {
    const auto [place, is_new] = samplers_.try_emplace({map.wrap_u, map.wrap_v, map.magnify_filter, map.minify_filter},
                                                       static_cast<int>(model_.samplers.size()));
    if (is_new) {
      tinygltf::Sampler sampler;
      std::tie(sampler.wrapS, sampler.wrapT, sampler.magFilter, sampler.minFilter) = place->first;
      model_.samplers.push_back(sampler);
    }
    return place->second;
  }

  tinygltf::Model& model_;
  std::map<std::tuple<int, int, int, int>, int> samplers_;
  std::map<std::pair<int, int>, int> textures_;
};

}  // namespace

std::vector<Material> read_materials(const tinygltf::Model& model, std::vector<std::string>& warnings) {
  std::vector<Material> materials;
  std::set<std::string> lost;
  for (const tinygltf::Material& theirs : model.materials) {
    materials.push_back(read_material(model, theirs));
    for (const auto& [name, value] : theirs.extensions) {
      if (name != kUnlit && name != kStrength) lost.insert(name);
    }
  }
  if (!lost.empty()) {
    std::string names;
    for (const std::string& name : lost) names += (names.empty() ? "" : ", ") + name;
    warnings.push_back("What the extensions " + names + " say of materials does not come along; the rest does.");
  }
  return materials;
}

std::vector<Image> read_images(const tinygltf::Model& model, const std::vector<std::string>& loaded) {
  std::vector<Image> images;
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    const tinygltf::Image& theirs = model.images[i];
    Image ours{theirs.name, percent_decoded(theirs.uri), i < loaded.size() ? loaded[i] : std::string()};
    if (theirs.bufferView >= 0 && static_cast<std::size_t>(theirs.bufferView) < model.bufferViews.size()) {
      const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(theirs.bufferView)];
      const bool has_buffer = view.buffer >= 0 && static_cast<std::size_t>(view.buffer) < model.buffers.size();
      const std::size_t size = has_buffer ? model.buffers[static_cast<std::size_t>(view.buffer)].data.size() : 0;
      if (view.byteOffset <= size && view.byteLength <= size - view.byteOffset) {
        const auto* bytes = reinterpret_cast<const char*>(model.buffers[static_cast<std::size_t>(view.buffer)].data.data());
        ours.bytes.assign(bytes + view.byteOffset, view.byteLength);
      }
    }
    images.push_back(std::move(ours));
  }
  return images;
}

void write_materials(const Appearance& appearance, const std::vector<int>& image_views, tinygltf::Model& model) {
  for (std::size_t i = 0; i < appearance.images.size(); ++i) {
    tinygltf::Image image;
    image.bufferView = image_views[i];
    image.mimeType = image_type(appearance.images[i].bytes);
    model.images.push_back(image);
  }
  MapWriter maps(model);
  for (const Material& ours : appearance.materials) {
    tinygltf::Material theirs;
    theirs.name = sound_text(ours.name);
    tinygltf::PbrMetallicRoughness& surface = theirs.pbrMetallicRoughness;
    surface.baseColorFactor.assign(ours.base_colour.begin(), ours.base_colour.end());
    surface.metallicFactor = ours.metallic;
    surface.roughnessFactor = ours.roughness;
    const double strength = std::max(1.0, ours.emissive.maxCoeff());
    const Eigen::Vector3d emissive = ours.emissive / strength;
    theirs.emissiveFactor.assign(emissive.begin(), emissive.end());
    if (strength > 1) {
      use_extension(model, kStrength);
      theirs.extensions[kStrength] =
          tinygltf::Value(tinygltf::Value::Object{{"emissiveStrength", tinygltf::Value(strength)}});
    }
    if (ours.unlit) {
      use_extension(model, kUnlit);
      theirs.extensions[kUnlit] = tinygltf::Value(tinygltf::Value::Object{});
    }
    if (ours.alpha_mode != AlphaMode::kOpaque) theirs.alphaMode = ours.alpha_mode == AlphaMode::kMask ? "MASK" : "BLEND";
    if (ours.alpha_mode == AlphaMode::kMask) theirs.alphaCutoff = ours.alpha_cutoff;
    theirs.doubleSided = ours.double_sided;
    maps.write(ours.base_colour_map, surface.baseColorTexture);
    maps.write(ours.metallic_roughness_map, surface.metallicRoughnessTexture);
    maps.write(ours.normal_map, theirs.normalTexture);
    theirs.normalTexture.scale = ours.normal_map.strength;
    maps.write(ours.occlusion_map, theirs.occlusionTexture);
    theirs.occlusionTexture.strength = ours.occlusion_map.strength;
    maps.write(ours.emissive_map, theirs.emissiveTexture);
    model.materials.push_back(std::move(theirs));
  }
}

}  // namespace hydrostat::io

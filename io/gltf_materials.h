#pragma once

#include <string>
#include <vector>

#include "io/appearance.h"

namespace tinygltf {
class Model;
}

namespace hydrostat::io {

/// The materials of a glTF file with KHR_texture_transform, KHR_materials_unlit and KHR_materials_emissive_strength. What
/// other extensions say of them is lost, which `warnings` tells. Maps of textures that are not there are left out.
std::vector<Material> read_materials(const tinygltf::Model& model, std::vector<std::string>& warnings);

/// The images of a glTF file: those that lie in its buffers with their bytes, those beside it by their place. `loaded` holds
/// the bytes of those written as data in the text, by index.
std::vector<Image> read_images(const tinygltf::Model& model, const std::vector<std::string>& loaded);

/// Adds materials to a model that has none yet, their textures and samplers, and images whose bytes lie in the buffer views
/// `image_views`.
void write_materials(const Appearance& appearance, const std::vector<int>& image_views, tinygltf::Model& model);

}  // namespace hydrostat::io

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hydrostat::io {

/// An image as a file holds it, undecoded.
struct Image {
  std::string name;   // for messages
  std::string file;   // where its bytes are to be found, as the clip file writes it; empty: here
  std::string bytes;  // of a PNG or JPEG file
};

/// How a material takes an image; the numbers of wrapping and filtering are glTF's.
struct TextureMap {
  int image = -1;                               // none
  int uv_set = 0;                               // which of the vertices' places in images
  int wrap_u = 10497, wrap_v = 10497;           // repeat
  int magnify_filter = -1, minify_filter = -1;  // not told
  double strength = 1;                          // of normals and occlusion [-]
  Eigen::Vector2d offset = Eigen::Vector2d::Zero(), scale = Eigen::Vector2d::Ones();  // of the place in the image
  double turn = 0;                                                                    // [rad] likewise
};

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

/// What a surface looks like, in the terms of glTF 2.0; colours are linear.
struct Material {
  std::string name;
  Eigen::Vector4d base_colour = Eigen::Vector4d::Ones();  // red, green, blue, alpha in 0..1
  double metallic = 0, roughness = 0.7;                   // [-]
  Eigen::Vector3d emissive = Eigen::Vector3d::Zero();
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  double alpha_cutoff = 0.5;  // of kMask
  bool double_sided = true, unlit = false;
  TextureMap base_colour_map, metallic_roughness_map, normal_map, occlusion_map, emissive_map;
};

/// Every map of a material.
template <typename AnyMaterial>
auto maps_of(AnyMaterial& material) {
  return std::array{&material.base_colour_map, &material.metallic_roughness_map, &material.normal_map,
                    &material.occlusion_map, &material.emissive_map};
}

/// What the skin looks like: all its triangles, part by part. A vertex of the skin is drawn as several where colour, place
/// in an image or normal differ between the triangles around it. No parts: nothing is known.
struct Appearance {
  struct Part {
    int material = -1;                  // none
    Eigen::VectorXi vertices;           // D; the skin's vertex that each drawn one is
    Eigen::Matrix3Xi triangles;         // 3 x T, of drawn vertices
    Eigen::Matrix3Xd normals;           // 3 x D in the bind pose, of length 1; none: the triangles are flat
    Eigen::Matrix4Xd tangents;          // 4 x D, along u, w tells v's side; for a normal map alone
    std::vector<Eigen::Matrix2Xd> uvs;  // of each set 2 x D, v downward
    Eigen::Matrix4Xd colours;           // 4 x D, factors on the base colour; or none
  };
  std::vector<Part> parts;
  std::vector<Material> materials;
  std::vector<Image> images;
};

struct Scene;
struct Rig;

/// What the rig's skin looks like when the bind pose is turned by `turn`; empty where the file tells of no material and no
/// colour.
Appearance build_appearance(const Scene& scene, const Rig& rig, const Eigen::Matrix3d& turn);

}  // namespace hydrostat::io

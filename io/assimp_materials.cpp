#include "io/assimp_materials.h"

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>
#include <optional>

#include "io/cut_polygons.h"

namespace hydrostat::io {
namespace {

double share(double value, double otherwise) { return std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : otherwise; }

Eigen::Vector3d colour(const aiMaterial& material, const char* key, const Eigen::Vector3d& otherwise) {
  aiColor3D told;
  if (material.Get(key, 0, 0, told) != AI_SUCCESS) return otherwise;
  return {share(told.r, otherwise[0]), share(told.g, otherwise[1]), share(told.b, otherwise[2])};
}

double factor(const aiMaterial& material, const char* key, double otherwise) {
  float told = 0;
  return material.Get(key, 0, 0, told) == AI_SUCCESS ? share(told, otherwise) : otherwise;
}

int wrap_of(aiTextureMapMode mode) {
  return mode == aiTextureMapMode_Clamp || mode == aiTextureMapMode_Decal ? 33071
         : mode == aiTextureMapMode_Mirror                                ? 33648
                                                                          : 10497;
}

class MaterialReader {
 public:
  MaterialReader(const aiScene& theirs, Scene& scene) : theirs_(theirs), scene_(scene) {}

  Material read(const aiMaterial& theirs) {
    Material ours;
    aiString name;
    if (theirs.Get(AI_MATKEY_NAME, name) == AI_SUCCESS) ours.name = name.C_Str();
    if (ours.name == AI_DEFAULT_MATERIAL_NAME) ours.name.clear();  // made up
    ours.base_colour.head<3>() = colour(theirs, "$clr.diffuse", Eigen::Vector3d::Constant(0.8));
    ours.emissive = colour(theirs, "$clr.emissive", Eigen::Vector3d::Zero());
    ours.roughness = factor(theirs, "$mat.roughnessFactor", ours.roughness);
    const double opacity = factor(theirs, "$mat.opacity", 1);
    if (opacity > 0 && opacity < 1) {  // 0 is what exporters mistake for "not transparent"
      ours.base_colour[3] = opacity;
      ours.alpha_mode = AlphaMode::kBlend;
    }
    std::string colour_path, opacity_path;
    ours.base_colour_map = map(theirs, aiTextureType_DIFFUSE, &colour_path);
    if (ours.base_colour_map.image < 0) ours.base_colour_map = map(theirs, aiTextureType_BASE_COLOR, &colour_path);
    ours.normal_map = map(theirs, aiTextureType_NORMALS);
    ours.emissive_map = map(theirs, aiTextureType_EMISSIVE);
    if (ours.emissive_map.image >= 0 && ours.emissive.isZero()) ours.emissive.setOnes();
    const bool has_opacity_map = path_of(theirs, aiTextureType_OPACITY, opacity_path);
    // glTF takes opacity from the colour's image: another image cannot be followed.
    if (has_opacity_map && opacity_path == colour_path) ours.alpha_mode = AlphaMode::kBlend;
    if (has_opacity_map && opacity_path != colour_path) {
      scene_.warnings.push_back("Material '" + ours.name + "' takes its opacity from '" + opacity_path +
                                "', which is left out; put opacity into the alpha of its colour's image.");
    }
    return ours;
  }

 private:
  static bool path_of(const aiMaterial& material, aiTextureType type, std::string& path) {
    aiString told;
    if (material.GetTextureCount(type) == 0 || material.GetTexture(type, 0, &told) != AI_SUCCESS) return false;
    path = told.C_Str();
    return !path.empty();
  }

  TextureMap map(const aiMaterial& material, aiTextureType type, std::string* told_path = nullptr) {
    TextureMap ours;
    std::string path;
    if (!path_of(material, type, path)) return ours;
    if (told_path) *told_path = path;
    ours.image = image(path);
    int set = 0;
    if (material.Get(AI_MATKEY_UVWSRC(type, 0), set) == AI_SUCCESS) ours.uv_set = std::max(0, set);
    int mode = 0;
    if (material.Get(AI_MATKEY_MAPPINGMODE_U(type, 0), mode) == AI_SUCCESS)
      ours.wrap_u = wrap_of(static_cast<aiTextureMapMode>(mode));
    if (material.Get(AI_MATKEY_MAPPINGMODE_V(type, 0), mode) == AI_SUCCESS)
      ours.wrap_v = wrap_of(static_cast<aiTextureMapMode>(mode));
    return ours;
  }

  int image(const std::string& path) {
    const auto [place, is_new] = images_.try_emplace(path, static_cast<int>(scene_.images.size()));
    if (!is_new) return place->second;
    Image ours{path, path, {}};
    // Height 0: a file's bytes, as many as the width.
    const aiTexture* embedded = theirs_.GetEmbeddedTexture(path.c_str());
    if (embedded != nullptr && embedded->mHeight == 0 && embedded->pcData != nullptr) {
      ours.file.clear();
      ours.bytes.assign(reinterpret_cast<const char*>(embedded->pcData), embedded->mWidth);
      if (embedded->mFilename.length > 0) ours.name = embedded->mFilename.C_Str();
    }
    scene_.images.push_back(std::move(ours));
    return place->second;
  }

  const aiScene& theirs_;
  Scene& scene_;
  std::map<std::string, int> images_;
};

/// The nodes that hold meshes, in the order of the tree.
void collect(const aiNode* node, std::vector<const aiNode*>& holders) {
  if (node->mNumMeshes > 0) holders.push_back(node);
  for (unsigned c = 0; c < node->mNumChildren; ++c) collect(node->mChildren[c], holders);
}

std::array<aiVector3D, 3> corners_of(const aiMesh& mesh, unsigned face) {
  const unsigned* indices = mesh.mFaces[face].mIndices;
  return {mesh.mVertices[indices[0]], mesh.mVertices[indices[1]], mesh.mVertices[indices[2]]};
}

/// Deals out the materials of the pieces that a node's meshes fell into: each keeps the order of its triangles, so that the
/// next one of the whole is the next of some piece. False where it is not.
bool deal_materials(const aiScene& whole, const aiNode& node, const aiScene& parts, const aiNode& node_of_parts,
                    std::vector<int>& materials) {
  struct Piece {
    const aiMesh* mesh;
    unsigned next = 0;
  };
  std::vector<Piece> pieces;
  for (unsigned m = 0; m < node_of_parts.mNumMeshes; ++m) pieces.push_back({parts.mMeshes[node_of_parts.mMeshes[m]]});
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *whole.mMeshes[node.mMeshes[m]];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices != 3) continue;
      const auto fits = [&](Piece& piece) {
        while (piece.next < piece.mesh->mNumFaces && piece.mesh->mFaces[piece.next].mNumIndices != 3) ++piece.next;
        return piece.next < piece.mesh->mNumFaces && corners_of(*piece.mesh, piece.next) == corners_of(mesh, f);
      };
      const auto piece = std::find_if(pieces.begin(), pieces.end(), fits);
      if (piece == pieces.end()) return false;
      materials.push_back(static_cast<int>(piece->mesh->mMaterialIndex));
      ++piece->next;
    }
  }
  return true;
}

}  // namespace

void read_materials(const aiScene& theirs, Scene& scene) {
  MaterialReader reader(theirs, scene);
  for (unsigned m = 0; m < theirs.mNumMaterials; ++m) scene.materials.push_back(reader.read(*theirs.mMaterials[m]));
}

void read_looks(const aiMesh& theirs, int material, SceneMesh& ours) {
  ours.triangle_materials.setConstant(ours.triangles.cols(), material);
  const auto count = static_cast<Eigen::Index>(theirs.mNumVertices);
  const auto finite = [](double value) { return std::isfinite(value) ? std::clamp(value, -1e6, 1e6) : 0.0; };
  if (theirs.HasNormals()) {
    ours.normals.resize(3, count);
    for (unsigned v = 0; v < theirs.mNumVertices; ++v)
      ours.normals.col(v) << finite(theirs.mNormals[v].x), finite(theirs.mNormals[v].y), finite(theirs.mNormals[v].z);
  }
  if (theirs.HasVertexColors(0)) {
    ours.colours.resize(4, count);
    for (unsigned v = 0; v < theirs.mNumVertices; ++v) {
      const aiColor4D& told = theirs.mColors[0][v];
      ours.colours.col(v) << share(told.r, 1), share(told.g, 1), share(told.b, 1), share(told.a, 1);
    }
    // One colour all over tells nothing but what programs fill in where there is none.
    if (((ours.colours.colwise() - Eigen::Vector4d(ours.colours.col(0))).array() == 0).all()) ours.colours.resize(4, 0);
  }
  for (unsigned set = 0; set < theirs.GetNumUVChannels(); ++set) {
    Eigen::Matrix2Xd places(2, count);
    for (unsigned v = 0; v < theirs.mNumVertices; ++v) {
      const aiVector3D& told = theirs.mTextureCoords[set][v];
      places.col(v) << finite(told.x), 1 - finite(told.y);  // theirs begin at the image's foot
    }
    ours.uvs.push_back(std::move(places));
  }
}

void read_fbx_materials(const std::string& path, const aiScene& geometry, Scene& scene) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_STRICT_MODE, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_ANIMATIONS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_WEIGHTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_CAMERAS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_LIGHTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* parts = read_in_triangles(importer, path, 0);
  if (parts == nullptr || parts->mRootNode == nullptr) return;
  std::vector<const aiNode*> nodes, nodes_of_parts;
  collect(geometry.mRootNode, nodes);
  collect(parts->mRootNode, nodes_of_parts);
  if (nodes.size() != nodes_of_parts.size()) return;
  std::vector<int> materials;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (!deal_materials(geometry, *nodes[n], *parts, *nodes_of_parts[n], materials)) return;
  }
  Eigen::Index triangles = 0;
  for (const SceneMesh& mesh : scene.meshes) triangles += mesh.triangles.cols();
  if (triangles != static_cast<Eigen::Index>(materials.size())) return;
  read_materials(*parts, scene);
  const int* next = materials.data();
  for (SceneMesh& mesh : scene.meshes) {
    mesh.triangle_materials = Eigen::Map<const Eigen::VectorXi>(next, mesh.triangles.cols());
    next += mesh.triangles.cols();
  }
}

}  // namespace hydrostat::io

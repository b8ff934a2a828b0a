#include "io/read_scene.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "retarget/error.h"

namespace hydrostat::io {

namespace {

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return extension;
}

}  // namespace

bool is_clip_file(const std::string& path) {
  const std::string extension = extension_of(path);
  return extension == ".fbx" || extension == ".glb" || extension == ".gltf" || extension == ".dae" || extension == ".bvh";
}

Scene read_scene(const std::string& path) {
  const std::string extension = extension_of(path);
  if (extension == ".gltf" || extension == ".glb") return read_gltf(path);
  if (extension == ".fbx" || extension == ".dae" || extension == ".bvh" || extension == ".obj" ||
      extension == ".stl") {
    return read_with_assimp(path);
  }
  throw Error(path, "file name", "'" + extension + "' is no known kind of clip file",
              "Give a file that ends in .fbx, .glb, .gltf, .dae or .bvh");
}

}  // namespace hydrostat::io

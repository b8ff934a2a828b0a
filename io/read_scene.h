#pragma once

#include <string>

#include "io/scene.h"

namespace hydrostat::io {

/// Reads a clip file by its extension, in this very process: .fbx, .dae and .bvh with assimp, .gltf and .glb with tinygltf;
/// .obj and .stl too, which hold a mesh alone.
/// A hostile file can end the process or hang it; read_in_worker() is the safe way. Throws Error.
Scene read_scene(const std::string& path);

/// Whether a file's name ends in what clip files end in: .fbx, .glb, .gltf, .dae or .bvh, in any case.
bool is_clip_file(const std::string& path);

/// assimp 5.2.5, with its known faults made good: see the file for each.
Scene read_with_assimp(const std::string& path);

/// glTF 2.0, text or binary. Steps, cubic splines and normalised integers are read as the file means them, which
/// assimp 5.2.5 does not do (it drops interpolation modes and reads integers as they lie).
Scene read_gltf(const std::string& path);

}  // namespace hydrostat::io

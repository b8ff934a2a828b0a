#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "physics/obstacle.h"

namespace hydrostat::io {

/// Reads a closed surface from a mesh file (.obj, .stl, .fbx, .dae, .glb, .gltf) in the worker process: all its meshes as they
/// stand at rest, in metres, y up, welded at equal places. A surface that looks inward is turned and triangles that welding
/// closes to a line are left out, which `warnings` tells. Throws Error where the file cannot be read or the surface is not closed.
physics::ClosedMeshOf<3> read_closed_mesh(const std::filesystem::path& file, std::vector<std::string>& warnings);

}  // namespace hydrostat::io

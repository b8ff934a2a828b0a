#pragma once

#include <string>

#include "io/scene.h"

struct aiMesh;
struct aiScene;

namespace hydrostat::io {

/// What assimp tells of a scene's materials and their images, appended to ours. `scene.materials` has as many more, in their
/// order; one that assimp made up looks like no material and has no name.
void read_materials(const aiScene& theirs, Scene& scene);

/// Normals and places in images of a mesh, whose triangles all wear `material`.
void read_looks(const aiMesh& theirs, int material, SceneMesh& ours);

/// Reads the FBX file of `geometry` once more, with its materials, and tells each triangle of our meshes its own. (Read with
/// materials at first, a mesh would fall into one for each of them.) `scene.meshes` are made of the triangles of `geometry`,
/// node by node in the order of its tree. Where the two readings disagree, no material is told.
void read_fbx_materials(const std::string& path, const aiScene& geometry, Scene& scene);

}  // namespace hydrostat::io

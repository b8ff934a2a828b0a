#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

struct aiScene;
namespace Assimp {
class Importer;
}

namespace hydrostat::io {

/// Cuts a polygon with corners [3 x N, any unit] in their order, N >= 3, into N - 2 triangles of its corners by cutting off
/// ears; the time grows little faster than N. Where it crosses itself the triangles overlap.
/// Source: Eberly, "Triangulation by Ear Clipping", Geometric Tools 2002.
std::vector<Eigen::Vector3i> cut_polygon(const Eigen::Matrix3Xd& corners);

/// Reads a file and leaves nothing but triangles, as assimp cuts them; polygons of more than 200 corners, over which it
/// takes time with their square and more, are cut by cut_polygon. `flags` are aiPostProcessSteps. Null where it cannot be
/// read.
const aiScene* read_in_triangles(Assimp::Importer& importer, const std::string& path, unsigned flags);

}  // namespace hydrostat::io

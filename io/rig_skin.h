#pragma once

#include <vector>

#include "io/rig.h"

namespace hydrostat::io {

/// The weighted bone whose origin, or line to a child, is nearest to a point of the bind pose; -1 where none is weighted.
int nearest_bone(const retarget::Skeleton& skeleton, const Eigen::Vector3d& point);

/// Longest side of the points' box.
double extent_of(const Eigen::Matrix3Xd& points);

/// Appends a mesh to the rig's skin: its vertices, which `into_bind` takes to the common bind space, its triangles and its
/// weights, made to sum to 1. `bones`: of each of its joints.
void add_mesh(const SceneMesh& mesh, const Eigen::Affine3d& into_bind, const std::vector<int>& bones, Rig& rig);

/// Binds vertices without weights to the nearest bone, welds those that share place and weights, and turns a closed skin's
/// triangles outward. Tells of it in the rig's warnings.
void finish_skin(Rig& rig);

}  // namespace hydrostat::io

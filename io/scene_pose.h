#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "io/scene.h"

namespace hydrostat::io {

/// Splits the linear part of a transform as rotation * stretch; the rotation is proper, a mirror goes into the stretch.
struct Turn {
  Eigen::Matrix3d rotation, stretch;
};
Turn split_turn(const Eigen::Matrix3d& linear);

/// Every scene node's transform to the scene [file units] at a time of the clip, or at rest without a clip: one per scene
/// node.
std::vector<Eigen::Affine3d> node_poses(const Scene& scene, const SceneClip* clip, double time_s);

}  // namespace hydrostat::io

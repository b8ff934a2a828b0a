#pragma once

#include "io/scene.h"

namespace hydrostat::io {

/// Whether a weight stays what it is at rest.
bool is_still(const Track& weight, double at_rest);

/// Gives a morph target its shape: offsets [file units] of all vertices of its mesh, 3 x V, of which those are kept that are
/// not zero.
void set_shape(const Eigen::Matrix3Xd& offsets, SceneMesh::Morph& morph);

/// Takes the channels of targets without a shape out of the clips: some move normals alone.
void forget_morphs_without_shape(Scene& scene);

}  // namespace hydrostat::io

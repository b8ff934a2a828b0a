#pragma once

#include <Eigen/Core>

#include "retarget/body_parts.h"
#include "retarget/control_mesh.h"
#include "retarget/number_cells.h"

namespace hydrostat::retarget {

/// Skin weights spread into the volume, B x N: nodes take the mean of the skin samples in their tets, the square of the
/// barycentric weight as strength, and a little of their neighbours; a node without samples takes its neighbours' mean. One
/// sparse solve with an M-matrix, so that no weight is negative, and every node's weights sum to 1.
Eigen::MatrixXd spread_bone_weights(const Skeleton& skeleton, const SkinnedMesh& skin, const BodyVoxels& body,
                                    const BodyParts& parts, const BodyCells& cells, const ControlMesh& mesh);

}  // namespace hydrostat::retarget

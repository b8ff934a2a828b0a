#pragma once

#include <vector>

#include "retarget/control_mesh.h"

namespace hydrostat::retarget {

/// Places in the tets of a mesh, one column each.
struct Places {
  Eigen::Matrix4Xi nodes;
  Eigen::Matrix4Xd weights;     // >= 0, sum 1
  std::vector<char> is_inside;  // otherwise: the nearest tet's nearest point, about
};

/// Where points (3 x P [m]) of the rest shape lie. bone_weights: B x N, bones that own the nodes; bones: B x P, those that
/// own the points. Where parts of the body lie in one another (copied cells) the limb decides, that is the tet whose owners
/// are most the point's.
Places locate(const ControlMesh& mesh, const Eigen::MatrixXd& bone_weights, const Eigen::Matrix3Xd& points,
              const Eigen::MatrixXd& bones);

}  // namespace hydrostat::retarget

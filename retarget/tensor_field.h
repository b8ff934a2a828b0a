#pragma once

#include "retarget/control_mesh.h"

namespace hydrostat::retarget {

// A field of symmetric tensors over a body, linear in its tets: six numbers (xx yy zz xy yz xz) a node, one below the other,
// in a column. Along a constraint of direction n it is n^T T n.

/// The field (6N x S) by its values along constraints (E x S), each the field's mean at both ends: the smoothest of those
/// that fit best, by least squares with a small weight on differences between the ends. Any unit.
Eigen::MatrixXd tensors_along(const Eigen::Ref<const Eigen::Matrix3Xd>& rest,
                              const Eigen::Ref<const Eigen::Matrix2Xi>& edges,
                              const Eigen::Ref<const Eigen::MatrixXd>& values);

/// The field along the constraints (2 x E') of another mesh, E' x S: on each the mean of three places. bone_weights: as in
/// locate, of the field's own mesh.
Eigen::MatrixXd values_along(const Eigen::MatrixXd& tensors, const ControlMesh& of, const Eigen::MatrixXd& bone_weights,
                             const ControlMesh& mesh, const Eigen::Matrix2Xi& constraints);

}  // namespace hydrostat::retarget

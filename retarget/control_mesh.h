#pragma once

#include <Eigen/Core>

namespace hydrostat::retarget {

/// The coarse tetrahedral body, in the bind pose.
struct ControlMesh {
  Eigen::Matrix3Xd nodes;     // [m] 3 x N
  Eigen::Matrix4Xi tets;      // 4 x T, positive volume
  Eigen::Matrix2Xi edges;     // 2 x E, each once, lower node first, in lexicographic order: the constraints
  Eigen::VectorXd tet_fill;   // T, share of the tet that the body fills, in (0, 1]
  Eigen::Vector3d cell_size;  // [m] of the lattice it was cut from
  int cells = 0;
  int bridged_cells = 0;  // cells added to join parts of the body by faces
  int copied_cells = 0;   // cells that stand twice or more, for parts that meet only in space

  int node_count() const { return static_cast<int>(nodes.cols()); }
};

/// Points carried by a control mesh: point p is the sum over k of weights(k, p) * node(nodes(k, p)).
/// The weights are barycentric in tet tets[p]: >= 0, sum 1.
struct Embedding {
  Eigen::VectorXi tets;      // P
  Eigen::Matrix4Xi nodes;    // 4 x P
  Eigen::Matrix4Xd weights;  // 4 x P
};

/// Positions [m] 3 x P of the embedded points for node positions [m] 3 x N.
Eigen::Matrix3Xd embedded_positions(const Embedding& embedding, const Eigen::Ref<const Eigen::Matrix3Xd>& nodes);

}  // namespace hydrostat::retarget

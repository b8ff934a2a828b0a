#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "retarget/clip.h"

namespace hydrostat::retarget {

struct BodyOptions {
  int nodes = 0;  // wanted; 0 is automatic: what fits the body best around 200, within 100 to 600
  Eigen::Vector3i lattice = Eigen::Vector3i::Zero();  // cells along x, y, z; 0 is chosen by the number of nodes
  double least_fill =
      0.06;  // a part that fills less of its cell, and reaches less far into it [cells], gets no cell: its skin is moved
  std::optional<int> mirror_axis = std::nullopt;  // 0 or 2: of a body that moves as its own mirror image across it
};

/// Which value of the options breaks which rule, empty when all is well.
std::string broken_rule(const BodyOptions& options);

/// The coarse tetrahedral body, in the bind pose: cells of a lattice, each cut into five tets. Tets 5 c to 5 c + 4 are cell
/// c.
struct ControlMesh {
  Eigen::Matrix3Xd nodes;        // [m] 3 x N
  Eigen::Matrix4Xi tets;         // 4 x T, positive volume
  Eigen::Matrix2Xi edges;        // 2 x E, each once, lower node first, in lexicographic order: the constraints
  Eigen::VectorXd tet_fill;      // T, share of the tet that the body fills, in (0, 1]
  Eigen::Vector3d origin;        // [m] lowest corner of the lattice; its bottom plane lies on the lowest skin point
  Eigen::Vector3d cell_size;     // [m] of the lattice
  Eigen::MatrixXi cell_nodes;    // 8 x C, bit d of a row's number is the corner's coordinate d: the body's hexahedra
  Eigen::Matrix3Xi cell_places;  // 3 x C, place of each cell in the lattice; copies have the same place
  Eigen::VectorXi vertex_cells;  // V, the cell that carries each skin vertex
  Eigen::MatrixXd bone_weights;  // B x N, skin weights spread into the volume: >= 0, each column sums to 1
  int cells = 0;
  int bridged_cells = 0;  // cells added to join parts of the body by faces
  int copied_cells = 0;   // cells beyond the first at a place, for parts that meet only in space
  int pieces = 0;         // face-connected pieces: always 1

  int node_count() const { return static_cast<int>(nodes.cols()); }
};

/// Points carried by a control mesh: point p is the sum over k of weights(k, p) * node(nodes(k, p)).
/// The weights are barycentric in tet tets[p]: >= 0, sum 1.
struct Embedding {
  Eigen::VectorXi tets;      // P
  Eigen::Matrix4Xi nodes;    // 4 x P
  Eigen::Matrix4Xd weights;  // 4 x P
  double max_miss = 0;       // [m] farthest way from a point to the body, where it was moved to

  Eigen::Index count() const { return tets.size(); }
};

/// Skin vertices that stand for the skin where contact is tested.
struct ContactPoints {
  Eigen::VectorXi vertices;  // P, of the skin
  Eigen::VectorXi bones;     // P, the bone of greatest weight
  Embedding embedding;       // P
};

/// Builds the body of a skin. The lattice spans the bounding box exactly; a cell is kept where the skin or its inside
/// touches it, once for each part of the body that is not connected within it, so that two legs in one cell stay two legs.
/// Limbs that are far apart along the skeleton never share a cell, not even where their skins touch. The body is one piece
/// joined by faces: what is not, is joined by the fullest cells between. Open, inside-out, overlapping and many-shelled
/// skins are bodies too; a flat sheet gives a thin one. Deterministic. Throws Error where the skin has no triangle or no
/// extent, or is too long and thin for 5000 nodes; shorter ones may take more nodes than wished. Up to eight lattices are tried for a wished number, as long
/// as what those before had of their estimates lets another come nearer. Source: Nesme, Kry, Jerabkova, Faure, "Preserving topology and
/// elasticity for embedded deformable models", SIGGRAPH 2009, section 3 (copies of cells). We count connection by faces of voxels and by bones, too.
ControlMesh build_control_mesh(const Skeleton& skeleton, const SkinnedMesh& skin, const BodyOptions& options = {});

/// Face-connected pieces of a tet mesh.
int count_pieces(const Eigen::Matrix4Xi& tets);

/// Embeds point p [m] (3 x P) in cell cells[p], in the tet that holds it. A point outside its cell is moved to the nearest
/// point of it.
Embedding embed(const ControlMesh& mesh, const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                const Eigen::Ref<const Eigen::VectorXi>& cells);

/// The skin's vertices (bind pose) in the body, each in the copy that its limb belongs to.
Embedding embed_skin(const ControlMesh& mesh, const SkinnedMesh& skin);

/// A subset of the skin's vertices, lowest first in the bind pose, none nearer to another of its limb than 0.35 of a cell. Where
/// symmetric, what lies as high and as far from the middle is chosen together, so that mirror images have mirror images: these may lie
/// nearer.
ContactPoints contact_points(const ControlMesh& mesh, const Skeleton& skeleton, const SkinnedMesh& skin, bool symmetric = false);

/// Positions [m] 3 x P of the embedded points for node positions [m] 3 x N.
Eigen::Matrix3Xd embedded_positions(const Embedding& embedding, const Eigen::Ref<const Eigen::Matrix3Xd>& nodes);

}  // namespace hydrostat::retarget

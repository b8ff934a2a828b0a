#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "retarget/body_parts.h"

namespace hydrostat::retarget {

/// The cells of the body and the nodes they share: parts that share all eight corners are one cell.
struct BodyCells {
  std::vector<int> cell_of_part;             // per part; kNone where dropped
  std::vector<int> place;                    // per cell, index in the grid of cells
  std::vector<double> fill;                  // per cell
  std::vector<std::array<int, 8>> nodes;     // per cell, by corner
  std::vector<Eigen::Vector3i> node_places;  // per node, in the lattice's planes

  int count() const { return static_cast<int>(place.size()); }
};

/// Numbers the cells of the kept parts and their nodes, in the order of the grid; linked parts share the corners of the face
/// between.
BodyCells number_cells(const Grid& grid, const BodyParts& body);

/// The cell of each skin vertex: of its own part, or where that was dropped of the nearest part, its own limb's first. V.
Eigen::VectorXi cells_of_vertices(const BodyVoxels& body, const BodyParts& parts, const BodyCells& cells,
                                  const std::vector<int>& vertex_parts, const SkinnedMesh& skin);

}  // namespace hydrostat::retarget

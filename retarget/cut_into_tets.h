#pragma once

#include "retarget/control_mesh.h"
#include "retarget/number_cells.h"
#include "retarget/voxelize.h"

namespace hydrostat::retarget {

/// Fills in the nodes, tets, edges and cells of a mesh, and how many pieces and copies these make; the skin's share, the
/// vertices and bones, is left as it is.
void cut_into_tets(const Lattice& lattice, const BodyCells& cells, ControlMesh& mesh);

}  // namespace hydrostat::retarget

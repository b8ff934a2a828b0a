#pragma once

#include <Eigen/Core>
#include <vector>

#include "retarget/control_mesh.h"
#include "retarget/voxelize.h"

namespace hydrostat::retarget {

/// The lattice of so many cells that spans the skin's bounding box exactly; a sheet lies in the middle of its one layer of
/// cells, or on its bottom along y.
Lattice fitted_lattice(const SkinnedMesh& skin, const Eigen::Vector3i& cells, int fine);

/// How ill a lattice suits: nodes off the wanted number, cells that the body does not fill, cells far from cubes. Lower is
/// better. Well-filled cells are what makes a limb one or two whole cells wide.
double misfit(double nodes, double mean_fill, const Eigen::Vector3d& cell_size, const BodyOptions& options);

/// Cells along x, y, z of lattices of near-cubic cells that span the box, the best-suited first, by an estimate of nodes and
/// fill within a few per cent.
std::vector<Eigen::Vector3i> ranked_lattices(const SkinnedMesh& skin, const TriangleSoup& closed,
                                             const BodyOptions& options);

}  // namespace hydrostat::retarget

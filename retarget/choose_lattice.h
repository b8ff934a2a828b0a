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

/// To be added to misfit() for a body that is to be its own mirror image (mirror_axis): cells take turns in how they are cut into tets, so
/// that an even number of them across is its own image, and an odd one has a middle column that bends it to one side. Of three it bears a
/// 27th of the stiffness in bending, which turns a worm by 0.2 degrees a cycle; of more it is let be. One alone has no better choice.
double lopsidedness(const Eigen::Vector3i& cells, const BodyOptions& options);

/// Cells along x, y, z of lattices of near-cubic cells that span the box, the best-suited first, by an estimate of nodes and
/// fill within a few per cent.
std::vector<Eigen::Vector3i> ranked_lattices(const SkinnedMesh& skin, const TriangleSoup& closed,
                                             const BodyOptions& options);

}  // namespace hydrostat::retarget

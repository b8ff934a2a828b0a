#pragma once

#include <Eigen/Core>
#include <vector>

#include "retarget/control_mesh.h"
#include "retarget/voxelize.h"

namespace hydrostat::retarget {

/// The lattice of so many cells that spans the skin's bounding box exactly; a sheet lies in the middle of its one layer of
/// cells, or on its bottom along y.
Lattice fitted_lattice(const SkinnedMesh& skin, const Eigen::Vector3i& cells, int fine);

/// A body in a lattice, as built or by an estimate.
struct LatticeBody {
  Eigen::Vector3i cells;
  Eigen::Vector3d cell_size;  // [m]
  double nodes, fill;         // fill: the mean share of its cells that the body takes
};

/// How ill a lattice suits: nodes off the wanted number, cells that the body does not fill, cells far from cubes. Lower is
/// better. Well-filled cells are what makes a limb one or two whole cells wide. Cells take turns in how they are cut into tets, so that
/// an even number of them across is its own mirror image, and an odd one has a middle column that bends the body to one side. Of three
/// it bears a 27th of the stiffness in bending, which turns a worm by 0.2 degrees a cycle: where the options tell a mirror axis these
/// suit ill; of more the column is let be, and one alone has no better choice.
double misfit(const LatticeBody& body, const BodyOptions& options);

/// Lattices of near-cubic cells that span the box, the best-suited first, by an estimate of nodes and fill. Of a full body it is within a
/// few per cent; one with thin limbs has up to two fifths more nodes.
std::vector<LatticeBody> ranked_lattices(const SkinnedMesh& skin, const TriangleSoup& closed, const BodyOptions& options);

}  // namespace hydrostat::retarget

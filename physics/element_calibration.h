#pragma once

#include "physics/element_block.h"

namespace hydrostat::physics {

/// Factor [-] on Young's modulus with which `tets` give way as much as `boxes`: meshes of the same nodes, materials and
/// fill, the boxes elements that do not lock. The body is held at either end of each axis in turn, and its weight acts
/// across: what the work of these loads is, to first order and summed over them, is compared. The slender parts' bending
/// rules the sum. A coarse mesh gets less than 1, a fine one 1; a uniform strain, which tets meet as they are, is then too
/// soft by it.
template <int Dim>
double unlocking_factor(const ElementMesh<Dim>& tets, const ElementMesh<Dim>& boxes);

}  // namespace hydrostat::physics

#pragma once

#include "physics/element_activation.h"
#include "physics/element_block.h"

namespace hydrostat::physics {

/// One element as a position constraint C = sqrt(2 U), whose energy C^2 / 2 is the element's own.
template <int Dim>
struct ElementConstraint {
  double value = 0;                                     // [J^1/2]
  Eigen::Matrix<double, Dim, (1 << Dim)> gradient;      // [J^1/2 / m] a column a node, of the element's first nodes
};

/// Where an element has all but collapsed, stable neo-Hookean has no force left that could unfold it: there the corotated law
/// takes its place, whose rotation always points the way out. Without stress, value and gradient are 0.
template <int Dim>
void evaluate(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>& active,
              ElementConstraint<Dim>& constraint);

/// Young's modulus times the volume of matter of an element [J]: in 2D the modulus of the solid in plane strain.
template <int Dim>
double youngs_modulus_times_volume(const ElementBlock<Dim>& block, int element);

}  // namespace hydrostat::physics

#pragma once

#include "physics/element_activation.h"
#include "physics/element_block.h"

namespace hydrostat::physics {

using ElementMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 24, 24>;

/// Second derivative [N/m] of one element's energy with respect to its nodes: row Dim n + i is component i of its node n.
/// kExact: as it is, but for F near a reflection, where no rotation is nearest. kProjected: positive semi-definite, by the
/// law's projected derivative and the hourglass part without the terms of its force (Gauss-Newton). Allocates nothing.
template <int Dim>
ElementMatrix element_stiffness(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x,
                                const ActiveStrain<Dim>* active, Definiteness definiteness);

/// Bound on the greatest angular frequency [rad/s] of the block's lumped masses under its elements, at the positions x:
/// the greatest of any element under its own share of mass. An explicit step without damping is stable below 2 over it.
/// Source: Belytschko, Liu, Moran, "Nonlinear Finite Elements for Continua and Structures", 2000, section 6.3 (element
/// eigenvalue inequality). Takes some 30 us an element.
template <int Dim>
double highest_frequency(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active);

/// By how much the stiffest element is stiffer at x than at rest [-], >= 1: from a bound on the second derivative of the law at
/// the mean deformation, over the same bound at rest. Dear as a sweep over the forces, so that a step can afford it.
template <int Dim>
double element_stiffening(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active);

/// Least det F [-] of each element: of a box, the least over its corners; E.
template <int Dim>
Eigen::VectorXd least_jacobians(const ElementBlock<Dim>& block, const ElementMesh<Dim>& mesh, const ConstNodeMatrix<Dim>& x);

}  // namespace hydrostat::physics

#pragma once

#include "physics/element_block.h"
#include "physics/element_constraints.h"

namespace hydrostat::physics {

/// The stress-free shape that activations ask of each element, for the kernels. A stretch A that varies inside the element is
/// taken out of the deformation, F_e = F A^-1: out of the mean as it is, out of the hourglass part to first order.
template <int Dim>
struct ActiveStrain {
  std::vector<Lanes> lanes;  // ActiveLayout, batch by batch as in the block
};

/// How the strain follows from the activations of an element's constraints: the symmetric strain and the hourglass part for
/// which the constraints' stretches, linearised at rest, are nearest to their activations (equal weights). A tet meets its
/// 6 activations; of a hexahedron's 28 a part of 18 dimensions is a shape. Linear in activation, so limits of activation
/// bound the strain: below about 40 % the active stretch A stays positive definite.
template <int Dim>
struct ActivationFit {
  Eigen::MatrixXi of_element;        // pairs per element x E, as in ElementConstraints
  Eigen::VectorXi map_of_element;    // E
  std::vector<Eigen::MatrixXd> maps;  // (strain, then hourglass coordinates [m]) x pairs; elements that are alike share one
};
template <int Dim>
ActivationFit<Dim> make_activation_fit(const ElementMesh<Dim>& mesh, const ElementConstraints& constraints);

/// An ActiveStrain for the block that asks for the rest shape.
template <int Dim>
ActiveStrain<Dim> make_active_strain(const ElementBlock<Dim>& block);

/// Sets the strain to what `activation` [-] (one per constraint; 1 is passive) asks. Allocates nothing.
/// False, with nothing promised of the strain, if an element would have to shrink to nothing or through itself.
template <int Dim>
bool set_activation(const ActivationFit<Dim>& fit, const Eigen::VectorXd& activation, ActiveStrain<Dim>& active);

/// Derivative of one element's forces with respect to the activations of its constraints [N], at node positions x [m]:
/// row Dim n + i is component i of the force on its node n, columns as in of_element.
template <int Dim>
Eigen::MatrixXd element_force_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                             const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>& active);

}  // namespace hydrostat::physics

#pragma once

#include "physics/element_block.h"
#include "physics/element_constraints.h"

namespace hydrostat::physics {

/// The stress-free shape that activations ask of each element, for the kernels. A stretch A that varies inside the element is
/// taken out of the deformation, F_e = F A^-1: out of the mean as it is, out of the hourglass part to first order.
/// Source of the active strain: Nardinocchi, Teresi, "On the active response of soft living tissues", Journal of Elasticity
/// 88, 2007. We count the energy per volume of the passive rest shape.
template <int Dim>
struct ActiveStrain {
  std::vector<Lanes> lanes;  // ActiveLayout, batch by batch as in the block
};

/// How the strain follows from the activations of an element's constraints: the symmetric logarithmic strain e, A = exp(e),
/// and the hourglass part for which the constraints' logarithmic stretches, linearised at rest, are nearest to the logarithms
/// of their activations (equal weights). Every positive activation thus has a shape, and equal ones have theirs exactly. A tet
/// meets its 6 activations to first order; of a hexahedron's 28 a part of 18 dimensions is a shape.
template <int Dim>
struct ActivationFit {
  Eigen::MatrixXi of_element;         // pairs per element x E, as in ElementConstraints
  Eigen::VectorXi map_of_element;     // E
  std::vector<Eigen::MatrixXd> maps;  // (strain, then hourglass coordinates [m]) x pairs; elements that are alike share one

  bool is_of_boxes() const { return of_element.rows() == (1 << Dim) * ((1 << Dim) - 1) / 2; }
};
template <int Dim>
ActivationFit<Dim> make_activation_fit(const ElementMesh<Dim>& mesh, const ElementConstraints& constraints);

/// An ActiveStrain for the block that asks for the rest shape.
template <int Dim>
ActiveStrain<Dim> make_active_strain(const ElementBlock<Dim>& block);

/// Sets the strain to what `activation` [-] (one per constraint; 1 is passive) asks. Allocates nothing.
/// False, with nothing promised of the strain, if an activation is not above 0.
template <int Dim>
bool set_activation(const ActivationFit<Dim>& fit, const Eigen::VectorXd& activation, ActiveStrain<Dim>& active);

/// Derivative of one element's forces with respect to the activations of its constraints [N], at node positions x [m] and at
/// `activation`: row Dim n + i is component i of the force on its node n, columns as in of_element.
template <int Dim>
Eigen::MatrixXd element_force_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                             const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation);
/// The same of its energy [J].
template <int Dim>
Eigen::RowVectorXd element_energy_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                                 const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation);

}  // namespace hydrostat::physics

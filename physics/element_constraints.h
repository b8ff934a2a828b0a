#pragma once

#include "physics/element_block.h"

namespace hydrostat::physics {

/// The activated lengths of a body: every pair of nodes of an element is one. A tet has its 6 edges, a hexahedron 12 edges,
/// 12 face diagonals and 4 body diagonals; elements that share a pair share its activation.
struct ElementConstraints {
  Eigen::Matrix2Xi nodes;       // 2 x C, each pair once, lower node first, in lexicographic order
  Eigen::MatrixXi of_element;   // pairs per element x E: constraint of the pair (a, b), a < b, in lexicographic order

  int count() const { return static_cast<int>(nodes.cols()); }
};
/// Constraints of elements given as nodes per element x E.
ElementConstraints make_element_constraints(const Eigen::MatrixXi& element_nodes);

/// Springs along the constraints.
struct ConstraintSprings {
  Eigen::Matrix2Xi nodes;       // 2 x C
  Eigen::VectorXd rest_length;  // [m] C
  Eigen::VectorXd stiffness;    // [N/m] C
};
/// Springs, for a block made from the mesh, that together resist a change of volume like a solid of `share` times each element's Young's modulus whose
/// springs obey Cauchy's relation (Poisson's ratio 1/4, in 2D plane strain). For tets that is make_body's rule for edges.
template <int Dim>
ConstraintSprings make_constraint_springs(const ElementMesh<Dim>& mesh, const ElementBlock<Dim>& block,
                                          const ElementConstraints& constraints, double share);

/// Sum of k/2 (l - a l0)^2 [J]; a is the activation [-], C.
template <int Dim>
double spring_energy(const ConstraintSprings& springs, const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation);

/// Adds minus the gradient of spring_energy to `force` [N] Dim x N. A spring of length zero has no direction and no force.
template <int Dim>
void add_spring_forces(const ConstraintSprings& springs, const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation,
                       NodeMatrix<Dim>& force);

/// Derivative of the force on each spring's second node with respect to its activation [N] Dim x C; the first node's is the
/// opposite. Force is linear in activation.
template <int Dim>
NodeMatrix<Dim> spring_force_per_activation(const ConstraintSprings& springs, const ConstNodeMatrix<Dim>& x);

}  // namespace hydrostat::physics

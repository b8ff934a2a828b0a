#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "physics/element_lanes.h"
#include "physics/material.h"

namespace hydrostat::physics {

template <int Dim>
using NodeMatrix = Eigen::Matrix<double, Dim, Eigen::Dynamic>;  // a column a node
template <int Dim>
using ConstNodeMatrix = Eigen::Ref<const NodeMatrix<Dim>, 0, Eigen::OuterStride<Dim>>;  // without gaps

/// What an element is made of.
struct ElementMaterial {
  double density = 1000;        // [kg/m3]
  double youngs_modulus = 2e6;  // [Pa]
  double poissons_ratio = 0.4;  // [-]
};

/// What the elements of a block are made from.
template <int Dim>
struct ElementMesh {
  NodeMatrix<Dim> rest;                    // [m] Dim x N
  Eigen::MatrixXi nodes;                   // Dim + 1 (simplices) or 2^Dim (boxes) x E
  std::vector<ElementMaterial> materials;  // E, or one for all
  Eigen::VectorXd fill;                    // E, share of the element that is matter, in (0, 1]: mass and stiffness follow it
};

/// Finite elements of one shape and one elastic law, ready for the step loop. Simplices (triangles, tets; of positive volume
/// in the order of their nodes) have constant strain. Boxes (quads, hexahedra; bit d of a node's number in the element is
/// its coordinate d) put their mean strain under the elastic law, and what the mean does not see (hourglasses) under a
/// stiffness of its own in the turned frame: the energy is V W(F) + h.S h / 2 with h = R^T x G, R the rotation of F.
/// For small strains that is the enhanced-strain element of enhanced_stiffness; forces have neither sum nor moment.
/// In 2D all is per metre of thickness, in plane strain.
/// Source of mean strain and hourglass vectors: Flanagan, Belytschko, "A uniform strain hexahedron and quadrilateral with
/// orthogonal hourglass control", IJNME 17, 1981; of a constant hourglass part that equals an enhanced-strain element: Puso,
/// "A highly efficient enhanced assumed strain physically stabilized hexahedral element", IJNME 49, 2000.
template <int Dim>
struct ElementBlock {
  ElasticLaw law = ElasticLaw::kStableNeoHookean;
  Eigen::MatrixXi nodes;        // nodes per element x E
  Eigen::VectorXd rest_volume;  // [m3], in 2D [m2]; E, of the whole element
  Eigen::MatrixXd nodal_mass;   // [kg] nodes per element x E: what each element adds to its nodes
  // For the kernels, four elements at a time (element_kernel.h); the last four are filled up with elements of no stiffness.
  std::vector<int> lane_nodes;  // 4 a node of an element, batch by batch
  std::vector<Lanes> lanes;

  int element_count() const { return static_cast<int>(nodes.cols()); }
  int nodes_per_element() const { return static_cast<int>(nodes.rows()); }
  int batch_count() const { return (element_count() + Lanes::kCount - 1) / Lanes::kCount; }
  bool is_box() const { return nodes_per_element() == 1 << Dim; }
};

/// Which element breaks which rule, and by what number; empty when all is well. Rules: node numbers exist, every element has
/// a volume that is not a sliver's (above 1e-6 of its longest edge cubed, in 2D squared; a box at each of its corners above
/// 1e-3 of its mean), materials obey broken_rule and have density > 0, 0 < fill <= 1.
template <int Dim>
std::string broken_rule(const ElementMesh<Dim>& mesh);

/// The mesh must break no rule.
template <int Dim>
ElementBlock<Dim> make_element_block(const ElementMesh<Dim>& mesh, ElasticLaw law);

/// Places of an element's nodes at rest [m], nodes per element columns.
template <int Dim>
NodeMatrix<Dim> corners_of(const ElementMesh<Dim>& mesh, int element);

/// Whether two elements are the same but for a shift, up to rounding: cells of a lattice are.
template <int Dim>
bool are_alike(const NodeMatrix<Dim>& corners, const NodeMatrix<Dim>& other);

/// Adds the elements' share to the lumped masses [kg], N.
template <int Dim>
void add_lumped_mass(const ElementBlock<Dim>& block, Eigen::VectorXd& mass);

/// Memory that the block holds [bytes].
template <int Dim>
std::size_t memory_of(const ElementBlock<Dim>& block);

}  // namespace hydrostat::physics

#pragma once

#include "physics/body.h"

namespace hydrostat::physics {

struct ElementBodyOptions {
  ElasticLaw law = ElasticLaw::kStableNeoHookean;
  double spring_share = 0;  // [-] of each element's Young's modulus that springs along its pairs of nodes add
  double damping_time = 0;  // [s] of the axial dashpots along all pairs, over the stiffness of springs of share 1
};

/// Elements for a body whose edges are the constraints of the mesh (make_element_constraints). The mesh must break no rule.
template <int Dim>
BodyElements<Dim> make_body_elements(const ElementMesh<Dim>& mesh, ElasticLaw law);

/// What the elements of a body were made from: make_body_elements gives them back to the bit.
template <int Dim>
ElementMesh<Dim> mesh_of(const BodyOf<Dim>& body, const BodyElements<Dim>& elements);

/// The body of finite elements: its edges are their constraints (every pair of nodes of an element), masses are lumped. Boxes
/// are cut into tets along a body diagonal (2D: triangles) for all that reads the body's tets. The mesh must break no rule.
template <int Dim>
BodyOf<Dim> make_body(const ElementMesh<Dim>& mesh, const ElementBodyOptions& options);
/// The same with tets of one's own, of positive volume: all their edges must be pairs of nodes of an element.
template <int Dim>
BodyOf<Dim> make_body(const ElementMesh<Dim>& mesh, const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic>& tets,
                      const ElementBodyOptions& options);

}  // namespace hydrostat::physics

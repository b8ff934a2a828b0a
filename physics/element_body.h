#pragma once

#include "physics/body.h"

namespace hydrostat::physics {

struct ElementBodyOptions {
  ElasticLaw law = ElasticLaw::kStableNeoHookean;
  double spring_share = 0;  // [-] of each element's Young's modulus that springs along its pairs of nodes add
  double damping_time = 0;  // [s] of the axial dashpots along all pairs, over the stiffness of springs of share 1
};

/// The body of finite elements: its edges are their constraints (every pair of nodes of an element), masses are lumped. Boxes
/// are cut into tets along a body diagonal (2D: triangles) for all that reads the body's tets. The mesh must break no rule.
template <int Dim>
BodyOf<Dim> make_body(const ElementMesh<Dim>& mesh, const ElementBodyOptions& options);

}  // namespace hydrostat::physics

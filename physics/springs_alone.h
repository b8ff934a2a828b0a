#pragma once

#include "physics/body.h"

namespace hydrostat::physics {

/// The body as the method 'spring' knows it: springs and dashpots along its edges, and nothing else. An element's pairs get
/// springs that together hold as much as it (make_body's rule, shared out over its pairs): Poisson's ratio is that of central
/// forces.
template <int Dim>
BodyOf<Dim> springs_alone(const BodyOf<Dim>& body);

}  // namespace hydrostat::physics

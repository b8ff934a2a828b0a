#pragma once

#include "retarget/scenario.h"

namespace hydrostat::retarget {

/// A body that at rest is a straight bar of one section. Without extent: no such body.
struct Bar {
  double length = 0, thickness = 0, breadth = 0;  // [m], thickness <= breadth <= length; in the plane both are one
  double softest = 0;                             // [Pa] the least Young's modulus
};

/// How many times the energy that the scene can give a body would be needed to bend it so far that parts of it meet: the ends of a
/// bar that turns by less than 2 acos(3 widths / length) stay apart, and to turn so far along all of it takes E I turn^2 / (2 length)
/// at least. What it gets: its speed at the start, its fall, pushes. 0 where that has no bound: activations, moving obstacles, flow,
/// buoyancy, a body that starts in the ground or an obstacle, or is no bar.
/// Source: bending energy of Euler's elastica, least where the curvature is even; the bound of the turn is ours.
template <int Dim>
double energies_to_fold(const ScenarioOf<Dim>& scenario, const Bar& bar, double duration_s);

}  // namespace hydrostat::retarget

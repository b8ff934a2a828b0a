#pragma once

#include "retarget/scenario.h"

namespace hydrostat::retarget {

/// Whether a body can come to what is around it within a time; bounds, so that what it does come to is always among it.
/// In flight its centre of mass goes its parabola, no farther from it than pushes take it, for activations move no centre of mass.
/// Once it may touch something, its speed over all nodes (the root of twice its energy over its mass) grows by no more than weight,
/// buoyancy and pushes give it: what stands still and resists only takes of it. What swims, pushes itself off by activations,
/// starts out of shape, or is taken along by clamps, flow or moving obstacles may come anywhere.
struct Reach {
  bool ground = false, obstacles = false, water = false;
};

/// How far a body comes by its speed, weight, buoyancy and pushes within a time [m], whatever turns it around.
template <int Dim>
double longest_way(const ScenarioOf<Dim>& scenario, double duration_s);

/// Of a scenario whose gravity and pushes are those that act; `water` is told of its surface, and true where it has none.
template <int Dim>
Reach reach_of(const ScenarioOf<Dim>& scenario, double duration_s);

}  // namespace hydrostat::retarget

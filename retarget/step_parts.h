#pragma once

#include "physics/scene.h"

namespace hydrostat::retarget {

/// What a pass over a scene's body goes over: how much of each there is.
struct StepParts {
  double one = 0, nodes = 0, edges = 0, springs = 0, dashpots = 0, volumes = 0;
  double simplices = 0, corotated = 0, boxes = 0;  // elements; corotated: of the simplices those of that law
  double active_simplices = 0, active_boxes = 0;   // likewise where activations change
  double wet = 0;                                  // places of the surface, for each fluid
};
/// [ns] where `costs` tells what one of each takes.
inline double worth(const StepParts& costs, const StepParts& counts) {
  return costs.one * counts.one + costs.nodes * counts.nodes + costs.edges * counts.edges + costs.springs * counts.springs +
         costs.dashpots * counts.dashpots + costs.volumes * counts.volumes + costs.simplices * counts.simplices +
         costs.corotated * counts.corotated + costs.boxes * counts.boxes + costs.active_simplices * counts.active_simplices +
         costs.active_boxes * counts.active_boxes + costs.wet * counts.wet;
}

/// `is_active`: activations change, of which finite elements ask more.
template <int Dim>
StepParts parts_of(const physics::SceneOf<Dim>& scene, bool is_active);

/// [ns] of a method: of an outer step, a pass over the body (a sweep over its constraints) and an assembled matrix, of each their parts; of a
/// product of two blocks; of a dashpot in a stage and in being placed for stages.
struct StepCosts {
  StepParts step, pass, assembly;
  double product = 0, stage = 0, placing = 0;
};

/// [ns] of contact, as physics/step_work.h has it, by impulses and by a potential.
struct ContactCosts {
  double search = 0, own_search = 0, wide_look = 0, impulse_look = 0, impulse_push = 0, potential_look = 0, potential_push = 0;
};

}  // namespace hydrostat::retarget

#pragma once

#include <vector>

#include "retarget/level.h"

namespace hydrostat::retarget {

/// What a level costs, before anything is carried over to it.
struct LevelCost {
  int wished = 0;  // nodes, as CreatureOptions has them; 0: the solved creature itself
  int nodes = 0;
  double work_ms = 0;  // counted, of solver and corrector, a frame of 1/60 s
};

/// Counted work [ms] of solver and corrector for a frame of 1/60 s, by a tenth of a second in which the body settles at
/// rest: the same on every machine.
double frame_work_ms(const physics::Scene& scene, Eigen::Index muscles, const ReplayOptions& options);

/// Of levels of four, two, one, a half, a quarter and an eighth of the number of nodes of the creature, the finest first.
std::vector<LevelCost> level_costs(const Performer& solved, const Rig& rig, const CreatureOptions& options,
                                   const ReplayOptions& replay);

}  // namespace hydrostat::retarget

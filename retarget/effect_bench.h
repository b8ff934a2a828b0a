#pragma once

#include <string>
#include <vector>

#include "retarget/simulation.h"

namespace hydrostat::retarget {

/// A scene with some of its effects.
struct EffectRow {
  std::string effect;            // "none", the name of the one that is on alone, or "all"
  double ms_per_sim_s = 0;       // as the clock of this thread has it
  double difference_length = 0;  // of the motion to that without any [per L, RMS over nodes and frames]
  bool stable = true;
  int guard_steps = 0;  // in which 'euler' took over, which is dear
};

/// Lets the scene go without effects, with each that it has alone, and with all of them.
template <int Dim>
std::vector<EffectRow> measure_effects(const ScenarioOf<Dim>& scenario, const SimulationOptions& options);

}  // namespace hydrostat::retarget

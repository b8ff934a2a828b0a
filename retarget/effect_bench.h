#pragma once

#include <string>
#include <vector>

#include "retarget/performance.h"
#include "retarget/simulation.h"

namespace hydrostat::retarget {

/// A scene with some of its effects, and what is missing where it has all but these.
struct EffectRow {
  std::string effect;            // "none", the name of the one that is on alone, or "all"
  double ms_per_sim_s = 0;       // as the clock of this thread has it
  double difference_length = 0;  // of the motion to that without any [per L, RMS over points and frames]
  bool stable = true;
  int guard_steps = 0;  // in which 'euler' took over, which is dear
  double without_ms_per_sim_s = 0;       // of the scene with all others; of "none" that is all, of "all" it is none
  double without_difference_length = 0;  // of that motion to the one with all
};

/// Lets the scene go without effects, with each that it has alone, with all but that one, and with all of them. Motions are compared
/// on the nodes. An effect may do nothing alone: the ground holds nothing where nothing falls.
template <int Dim>
std::vector<EffectRow> measure_effects(const ScenarioOf<Dim>& scenario, const SimulationOptions& options);

/// The same of a creature, `scenario` its performed one, with embedding and wobble as effects of the picture: motions are compared
/// on the skin. Without embedding it stays as it starts. The times of both are counted at the frames that explain counts.
std::vector<EffectRow> measure_effects(const Performer& performer, const ScenarioOf<3>& scenario, const SimulationOptions& options);

}  // namespace hydrostat::retarget

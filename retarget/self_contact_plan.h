#pragma once

#include <string>

#include "retarget/fold_energy.h"
#include "retarget/performance.h"
#include "retarget/scenario.h"

namespace hydrostat::retarget {

/// Whether an effect was asked for.
enum class Wish { kAuto, kOn, kOff };

/// Whether a body is held against itself, and why.
struct SelfContactPlan {
  physics::SelfContact settings;
  std::string reason;
};

/// Of a scene whose body, surroundings, waves and clamps are all there. By itself it is on where parts of the body may come
/// to meet: there are several pieces, or two parts that are far from each other along the body stand within two cells, or
/// the body is so slender that bent into a ring it is strained by no more than its own length; and off where nothing bends
/// it, where it starts out of shape: it could then not find back through itself, and where a slender `bar` is so stiff that all the
/// energy it gets within `duration_s` folds it by far not.
template <int Dim>
SelfContactPlan plan_self_contact(const ScenarioOf<Dim>& scenario, StartShape start, Wish wish, double friction, const Bar& bar,
                                  double duration_s);

/// Of the parts of a body that splits, from its first break on: as the whole body is where that touches itself, and else on
/// unless it is turned off or the body starts out of shape. Left in the scenario's fracture; adds to the plan's reason.
template <int Dim>
void plan_parts_contact(StartShape start, Wish wish, double friction, ScenarioOf<Dim>& scenario, SelfContactPlan& plan);

/// Of a creature: on where the target brings parts within a cell of each other that are four or more apart in the bind
/// pose, and between these alone.
SelfContactPlan plan_self_contact(const Performer& performer);

}  // namespace hydrostat::retarget

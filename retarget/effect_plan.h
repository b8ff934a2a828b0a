#pragma once

#include <map>
#include <string>

#include "retarget/scenario.h"
#include "retarget/self_contact_plan.h"

namespace hydrostat::retarget {

/// The effects that a scene may tell on or off, beside self_contact, in the order in which reports tell them.
const std::vector<std::string>& switchable_effects();

/// For ever, as far as a plan goes [s]: longer than any scene.
constexpr double kUnending = 3600;

/// Decides each effect and takes those that are off out of the scenario, so that they cost nothing; the decisions are left
/// in it. By themselves effects are on that the scene has and that can come to matter within `duration_s`: ground, obstacles and
/// water that the body can reach by then (retarget/reach.h), pushes that begin before its end, air whose resistance can be half a
/// percent of the weight. Returns the name of the first effect that was asked for and cannot be, with what is
/// wrong; empty when all is well.
template <int Dim>
std::string plan_effects(const std::map<std::string, Wish>& wishes, ScenarioOf<Dim>& scenario, double duration_s = kUnending);

}  // namespace hydrostat::retarget

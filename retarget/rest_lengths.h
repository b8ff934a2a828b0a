#pragma once

#include "physics/body.h"
#include "retarget/inverse_dynamics.h"

namespace hydrostat::retarget {

/// Strain [-] beyond which a spring is taken too far for its muscle: it can follow no further where its limit is chosen for it.
constexpr double kMostSpringStrain = kMostAutomaticLimit;

/// Share of the springs that a target takes too far; 0 of finite elements.
double share_overstrained(const Motion& target, const physics::Body& body);

/// Gives each of these the middle of the lengths that the target takes it through as its rest length. A limb that is bound folded and
/// that a clip stretches else pulls its fold together by forces that no activation within its limit takes away, and others are spent on
/// holding against them. Stiffnesses stay, and so do bodies of finite elements, whose constraints tell a strain and pull by nothing themselves.
void fit_rest_lengths(const Motion& target, physics::Body& body);

/// Rest lengths over the constraints' lengths in the rest shape, E; 1 but for what fit_rest_lengths changed.
Eigen::VectorXd natural_stretch(const physics::Body& body);
bool has_fitted_rest_lengths(const physics::Body& body);

}  // namespace hydrostat::retarget

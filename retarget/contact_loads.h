#pragma once

#include "physics/stepper.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// From when on a contact point or a patch bears load within a control step, and from when on it slides.
struct ContactThresholds {
  double point_impulse, patch_impulse;  // [N s]
  double sliding_speed;                 // [m/s]
};

/// For a body of length L `length` [m] and control steps of `seconds`.
ContactThresholds contact_thresholds(const physics::Scene& scene, double length, double seconds);

/// The strength of gravity, or the Earth's where there is none [m/s2]: a unit for forces and speeds.
double gravity_unit(const physics::Scene& scene);

/// How stiff [N/m] a model that looks horizon_s [s] ahead in one step holds a contact point: against the body's own springs that is stiff,
/// and soft enough for a factor. Over 1/30 s a point gives half a thousandth of L, `length` [m], under the weight.
double contact_stiffness(const physics::Scene& scene, double length, double horizon_s);

/// Height [m] of a contact point above what is nearest: the ground or an obstacle; negative inside. Far away where there is neither.
double height_above_ground(const physics::Scene& scene, const physics::State& state, int point);

/// What contact points do, P: `impulse` 3 x P [N s] is what the ground gave each of them in the control step that ends in
/// `state`.
std::vector<ContactState> point_states(const physics::Scene& scene, const physics::State& state,
                                       const Eigen::Matrix3Xd& impulse, const ContactThresholds& thresholds);

/// The load on a patch.
struct PatchLoad {
  double normal_impulse = 0;  // [N s]
  double speed = 0;           // [m/s] of its points along the ground, mean by load; 0 without
};
PatchLoad patch_load(const physics::Scene& scene, const Patch& patch, const physics::State& state,
                     const Eigen::Matrix3Xd& impulse);

/// Height [m] of a patch's lowest point, as height_above_ground has it.
double patch_height(const physics::Scene& scene, const Patch& patch, const physics::State& state);

}  // namespace hydrostat::retarget

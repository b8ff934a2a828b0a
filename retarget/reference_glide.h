#pragma once

#include "physics/body.h"
#include "retarget/best_fit_rotation.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// Turn about y [rad] of a rotation that is near one about y.
double yaw_of(const Eigen::Matrix3d& rotation);

/// A rigid move in the plane of the ground by which the reference may follow the body, so that legs never chase far targets.
struct ReferenceGlide {
  double reach = 0, turn_reach = 0;  // [m], [rad]: errors up to here are corrected, the reference gives way to larger ones
  double x = 0, z = 0, yaw = 0;      // [m], [rad]

  /// Gives way to the error of `fit`, from the target to the body, and leaks back over `seconds`.
  void follow(const RigidFit& fit, double seconds);
  /// Moves a reference whose centre of mass is `com` [m].
  void apply(const Eigen::Vector3d& com, physics::State& reference) const;
};

/// The glide for a target whose nodes move at `speed` [m/s] RMS, corrected over settle_s [s]; length [m] is L. A slow
/// creature is not asked to catch up fast.
ReferenceGlide make_glide(double speed, double settle_s, double length);

/// The glide for a plan. What is dragged over the ground goes as far as friction lets it: its reference gives way at once, as for a
/// creature that stands, for chasing a path would only twist and roll the body.
ReferenceGlide glide_for(const PreparedTarget& plan, double settle_s, double length);

}  // namespace hydrostat::retarget

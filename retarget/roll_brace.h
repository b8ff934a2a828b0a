#pragma once

#include <Eigen/Core>

#include "physics/body.h"
#include "retarget/best_fit_rotation.h"
#include "retarget/long_axis.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// What lies on the ground and is long and round rolls like a log when it is pushed from the side, and its feedback along the way has no
/// hold on that: nothing reaches out. A log that bends in the plane of the ground cannot roll on. This bends the body sideways, as a whole,
/// by its roll and the rate of it beyond what a crawl does by itself; its plane is in part the body's own, which gravity lays flat, so
/// that the body rolls back. Bodies on legs, and those that are not slender, have none. The bend is one of the body's own activations. The
/// method is ours; gains were measured on a worm under pushes of 0.5 m/s in 8 directions.
class RollBrace {
 public:
  /// gravity [m/s2].
  RollBrace(const PreparedTarget& plan, const physics::Body& body, double gravity);

  bool is_needed() const { return bends_.size() > 0; }
  /// `fit`: from the target of `time_s` to the body, `seconds` after the last.
  void follow(const RigidFit& fit, double time_s, double seconds);
  /// Changes `activation`, E.
  void apply(Eigen::VectorXd& activation) const;
  /// The largest change of an activation; its sign tells the side.
  double bend() const { return bend_; }
  /// [rad] about the body's long axis, from the target's.
  double roll() const { return roll_; }

 private:
  double turn_per_s_ = 0;       // [rad/s] of the target, about y
  double swing_s_ = 0;          // sqrt(height / g)
  Eigen::Vector3d along_;       // of the target's first frame
  Eigen::MatrixX3d bends_;      // E x 3, empty where it is not needed
  Eigen::Vector3d side_ = Eigen::Vector3d::Zero();  // to which it bends, in the target's first frame
  double bend_ = 0, roll_ = 0;
};

}  // namespace hydrostat::retarget

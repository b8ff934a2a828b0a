#pragma once

#include <Eigen/Core>

#include "physics/scene.h"
#include "retarget/best_fit_rotation.h"
#include "retarget/long_axis.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// What lies on the ground and is long and round rolls like a log when it is pushed from the side, and its feedback along the way has no
/// hold on that: nothing reaches out. A log that bends in the plane of the ground cannot roll on. This bends the body sideways, as a whole,
/// by its roll and the rate of it beyond what a crawl does by itself; its plane is in part the body's own, which gravity lays flat, so
/// that the body rolls back. Bodies on legs, and those that are not slender, have none. The bend is one of the body's own activations.
///
/// The rate is for the most part that of the body's angular momentum about a line on the ground, along it and under its centre of mass. What
/// a bend does at once, before gravity answers to it, turns the trunk the wrong way, and feedback of the trunk's rate alone feeds that: the
/// body rocks on for good. Momentum about the ground changes by gravity and contact alone. It does not tell how it is shared between a
/// trunk that turns and one that slides, which the trunk's own rate does. The method is ours; gains were measured on worms of 100 and 198
/// nodes under pushes of 0.5 m/s.
class RollBrace {
 public:
  /// The scene that the plan was made for, whose ground is level; it must outlive the brace.
  RollBrace(const PreparedTarget& plan, const physics::Scene& scene);

  bool is_needed() const { return bends_.size() > 0; }
  /// `fit`: from the target of `time_s`, in the state `reference`, to the body in its `state`, `seconds` after the last.
  void follow(const RigidFit& fit, const physics::State& reference, const physics::State& state, double time_s, double seconds);
  /// Changes `activation`, E.
  void apply(Eigen::VectorXd& activation) const;
  /// The largest change of an activation; its sign tells the side.
  double bend() const { return bend_; }
  /// [rad] about the body's long axis, from the target's.
  double roll() const { return roll_; }

 private:
  const physics::Scene& scene_;
  double turn_per_s_ = 0;       // [rad/s] of the target, about y
  double swing_s_ = 0;          // sqrt(height / g)
  Eigen::Vector3d along_;       // of the target's first frame
  Eigen::MatrixX3d bends_;      // E x 3, empty where it is not needed
  Eigen::Vector3d side_ = Eigen::Vector3d::Zero();  // to which it bends, in the target's first frame
  double bend_ = 0, roll_ = 0;
};

}  // namespace hydrostat::retarget

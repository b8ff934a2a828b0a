#pragma once

#include <Eigen/Core>

#include "physics/stepper.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// How a creature stands on a slope. Its plan is for level ground; laid on a slope as it is, the body hangs over its lower feet, and feedback
/// that pulls it back from there never gets it upright, since it acts on errors alone. So the reference leans uphill: each node as far
/// as it is high, so that feet stay in their places, and the signals take the lengths that the constraints have in a body that leans so.
///
/// It leans all the way to the vertical across a narrow base, and less along a long one, on which load that shifts from foot to foot does it:
/// by floor + (1 - floor) (I + (C / (k h^2))^2)^-1, of the second moments C of what bears load about the centre of mass and that one's
/// height h. Legs give way sideways under any base, for them the floor is not zero. What neither stands on legs nor drags itself, as a drop that
/// sits on its belly, is left alone, for it hardly gives way and would slip. Sources: Pai, Patton, "Center of mass velocity-position predictions
/// for balance control", Journal of Biomechanics 30, 1997, for a base's extent as what stability asks for; the law and its constants are ours, from
/// trials with a trot, a fox, a spider and a worm.
class SlopeLean {
 public:
  /// `model` is the scene that the corrector believes in: ground y = offset, gravity of any direction.
  SlopeLean(const PreparedTarget& plan, const physics::Scene& model);

  bool is_needed() const { return !slope_.isZero(0); }
  /// The lean [m per m of height] where the target has turned by `yaw` [rad] since its first frame.
  Eigen::Vector3d at(double yaw) const;
  /// Shears a reference by `lean`, and keeps what the constraints' lengths become by it.
  void apply(const Eigen::Vector3d& lean, const Eigen::Matrix2Xi& constraints, physics::State& reference);
  /// Gives signals, E, the lengths of the last reference.
  void apply(Eigen::VectorXd& activation) const;

 private:
  double ground_;            // [m] its height
  Eigen::Vector2d slope_;    // x and z of the way up that goes 1 m along y
  Eigen::Matrix2d share_;    // of that, for the target's heading in its first frame
  Eigen::VectorXd stretch_;  // E, empty before the first reference
};

}  // namespace hydrostat::retarget

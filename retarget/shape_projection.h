#pragma once

#include <vector>

#include "physics/stepper.h"
#include "physics/system_matrix.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// Where a contact point has to be in one frame.
struct Hold {
  int point;
  Eigen::Vector3d place;
  bool sideways;  // x and z too, not the height alone
};

/// Where patches stand: the mean place of each point over each run of sticking frames; what slides is held in height alone.
std::vector<std::vector<Hold>> find_holds(const ContactSchedule& contacts, const Motion& points);

/// Least heights of the contact points over the frames [m], P x F: 0 in contact, `clearance` away from it, fading between over
/// `fade` frames.
Eigen::MatrixXd floors(const ContactSchedule& contacts, bool loop, double clearance, int fade);

/// The nearest shape (tether by mean mass) of unit volume ratio in every tet that keeps the holds and stays above the ground.
/// Newton on tether + volume + a little of the springs. Constraints that the target strains beyond `reach` [-] are held back to it.
class ShapeProjector {
 public:
  /// length [m] is L; `firmness` (1: as usual) is how much more firmly holds and tether pull. The scene must outlive the projector.
  ShapeProjector(const physics::Scene& scene, double length, bool keep_volume, double firmness);

  /// `floor` [m]: the least height of each contact point; `reach` [-] may be infinite.
  Eigen::Matrix3Xd project(const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds, const Eigen::VectorXd& floor, double reach);

 private:
  Eigen::Vector3d error_of(const Hold& hold, const Eigen::Matrix3Xd& x) const;
  double energy_of(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds,
                   const Eigen::VectorXd& floor) const;
  /// Force and stiffness of all that pulls; false where the matrix has no factor.
  bool find_step(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds, const Eigen::VectorXd& floor,
                 Eigen::MatrixXd& step);
  void pull(int p, const Eigen::Vector3d& error, bool sideways, Eigen::Matrix3Xd& force);

  const physics::Scene& scene_;
  physics::Body body_;
  physics::SystemMatrix matrix_;
  Eigen::VectorXd shape_;  // activation for which the animator's shape, as far as it is within reach, has no stress
  double tether_ = 0, hold_ = 0;
};

/// Projects all frames, twice with what the projection changed smoothed over time at `smooth_hz`, then once more so that contacts
/// hold. `reach` F: see ShapeProjector.
Motion project_frames(const Motion& motion, const std::vector<std::vector<Hold>>& holds, const Eigen::MatrixXd& floor,
                      const Eigen::VectorXd& reach, ShapeProjector& projector, double smooth_hz);

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/Core>

#include "physics/body.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// Where a creature is while its signals alone move it, told by how far that is from its target; feedback asks for nothing there.
/// Empty: on the target itself, as long as nobody knows better. A loop's turns with the target from period to period, and does not travel.
struct NominalPath {
  Motion place;     // [m] 3N x S of one period or one run
  Motion velocity;  // [m/s] likewise: what a body that strikes the ground has is not the slope of its places

  bool is_empty() const { return place.count() == 0; }
};

/// A nominal path at any time.
class NominalPathCurve {
 public:
  explicit NominalPathCurve(const NominalPath& path);
  /// Moves `reference`, the target's state at that time [s], to the path.
  void apply(double time_s, physics::State& reference);

 private:
  bool is_empty_;
  MotionCurve place_, velocity_;
  Eigen::Matrix3Xd offset_, slope_;
};

/// What one replay tells about the path that it took, a column a control step.
struct Lesson {
  Eigen::VectorXd time_s;      // S, of the states; what was added is held for a control step from there on
  Eigen::MatrixXd added;       // E x S: activations that came on top of the signals
  Eigen::MatrixXd place;       // 3N x S [m]: from the nominal path, as it glides, to the body, as the target heads in its first period
  Eigen::MatrixXd velocity;    // 3N x S [m/s]

  void make_room(Eigen::Index activations, Eigen::Index coordinates, Eigen::Index steps);
  void cut(Eigen::Index steps);
};

}  // namespace hydrostat::retarget

#pragma once

#include <vector>

#include "retarget/motion.h"
#include "retarget/scenario.h"
#include "retarget/trace.h"

namespace hydrostat::retarget {

/// What a scene tells of the world that a creature is let go in, beside what its physics::Scene has.
///
/// The body is simulated in the frame of its ground: as its target was prepared, upright on a ground that is level, while gravity,
/// obstacles and flows are turned. `turn` and `pivot` lead from there to the world, in which y is up.
struct World {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  // from the frame of the ground to the world's
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();     // [m] under the centre of mass at the start, on the ground; stays where it is
  std::vector<MoveOf<3>> moves = {};                   // these and what follows in the frame of the ground
  std::vector<Push> pushes = {};
  std::vector<EffectDecision> decisions = {};  // of the effects that can be told on or off; none where there is no scene

  bool is_told() const { return !decisions.empty(); }
  bool is_turned() const { return turn != Eigen::Matrix3d::Identity(); }
};

/// The motion as the world sees it. A turned loop is written out, for as many periods as last for `duration_s`.
Motion in_world(const World& world, const Motion& motion, double duration_s);

/// The trace as the world sees it, its moments about the world's origin.
Trace in_world(const World& world, const Trace& trace);

/// How an obstacle has travelled since the start, 3 x F.
Motion travel_of(const std::vector<MoveOf<3>>& moves, int obstacle, double rate_hz, Eigen::Index frames);

}  // namespace hydrostat::retarget

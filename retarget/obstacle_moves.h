#pragma once

#include "retarget/scenario.h"

namespace hydrostat::retarget {

/// Gives the obstacles the velocities of the step of dt [s] that begins then: a move counts with the share of the step that it
/// lasts. Without moves nothing changes.
template <int Dim>
void move_obstacles(const std::vector<MoveOf<Dim>>& moves, double begin_s, double dt, std::vector<physics::ObstacleOf<Dim>>& obstacles) {
  for (const MoveOf<Dim>& move : moves) obstacles[static_cast<std::size_t>(move.obstacle)].velocity.setZero();
  for (const MoveOf<Dim>& move : moves) {
    const double seconds = std::min(begin_s + dt, move.until_s) - std::max(begin_s, move.from_s);
    if (seconds > 0) obstacles[static_cast<std::size_t>(move.obstacle)].velocity += seconds / dt * move.velocity;
  }
}

}  // namespace hydrostat::retarget

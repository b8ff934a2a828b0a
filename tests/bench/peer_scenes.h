#pragma once

#include <string>
#include <vector>

#include "physics/stepper.h"

namespace hydrostat::bench {

/// A bar of 1 x 0.25 x 0.25 m, six tets a cell, stable neo-Hookean, 1000 kg/m3, undamped, masses lumped, and how it starts.
struct PeerScene {
  std::string name;
  physics::Scene scene;
  physics::State start;
  physics::ElementMaterial material;
};
inline constexpr int kSizes[3][2] = {{8, 2}, {12, 4}, {24, 6}};  // cells along and across: 192, 1,152 and 5,184 tets

/// Held where x = 0, falls under its weight.
PeerScene cantilever(int cells_along, int cells_across, const physics::ElementMaterial& material);
/// Without gravity, stretched by a tenth along its length, turns at (6, 3, 4) rad/s.
PeerScene tumbling(int cells_along, int cells_across, const physics::ElementMaterial& material);

/// A motion as it is looked at: places and velocities at `kFramesPerSecond`, the start first.
struct Motion {
  std::vector<physics::State> frames;
  bool is_whole = true;  // false: the method gave up before the end
};
inline constexpr int kFramesPerSecond = 60;
inline constexpr double kDuration = 2;  // [s]

/// Steps `stepper` at `steps_per_second`, a multiple of kFramesPerSecond.
Motion run(physics::Stepper& stepper, const PeerScene& scene, int steps_per_second);

/// What a motion is worth.
struct Verdict {
  double error = 0;           // [m] root of the mean square of the distance of nodes from the reference, over all frames
  double least_jacobian = 1;  // [-] in any frame
  double volume_error = 0;    // [-] of the whole body, the most in any frame
  double angular_loss = 0;    // [-] change of angular momentum about the COM over that of the start; 0 for held bodies
  bool is_sound = true;       // whole, at the end no inverted tet and a volume no farther off than the start's by 2 %
};
Verdict judge(const PeerScene& scene, const Motion& motion, const Motion& reference);

}  // namespace hydrostat::bench

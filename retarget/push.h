#pragma once

#include <algorithm>
#include <vector>

#include "physics/dimension.h"

namespace hydrostat::retarget {

/// A declared effect: a uniform force on all nodes that would change the body's velocity by delta_v within duration_s.
template <int Dim>
struct PushOf {
  double time_s = 0, duration_s = 0.1;
  physics::VectorOf<Dim> delta_v = physics::VectorOf<Dim>::Zero();  // [m/s]
};
using Push = PushOf<3>;

/// The velocity [m/s] that all pushes together give between two times: each counts with the share of its duration that lies
/// there.
template <int Dim>
physics::VectorOf<Dim> pushed_velocity(const std::vector<PushOf<Dim>>& pushes, double begin, double end) {
  physics::VectorOf<Dim> velocity = physics::VectorOf<Dim>::Zero();
  for (const PushOf<Dim>& push : pushes) {
    const double seconds = std::min(end, push.time_s + push.duration_s) - std::max(begin, push.time_s);
    if (seconds > 0) velocity += seconds / push.duration_s * push.delta_v;
  }
  return velocity;
}

}  // namespace hydrostat::retarget

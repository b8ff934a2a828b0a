#pragma once

#include <deque>
#include <random>

#include "physics/body.h"

namespace hydrostat::retarget {

/// What stands between the body and who corrects it. What touches the ground is felt at once and for sure.
struct Observation {
  double noise_m = 0;  // [m] RMS of each coordinate of each node
  double delay_s = 0;  // [s], rounded to whole control steps
  unsigned seed = 1;   // of the noise

  bool is_exact() const { return noise_m == 0 && delay_s == 0; }
};

/// The body as it is measured: late, and with a noise of each node's own that is drawn anew in every control step. Velocities are
/// then the differences of the places seen.
class Observer {
 public:
  Observer(const Observation& observation, double control_s);

  /// Takes the state after each control step, the first included, and returns what is seen of it. The first states are seen until
  /// the delay has passed.
  const physics::State& see(const physics::State& state);
  /// By how many control steps what is seen lies back.
  long delay_steps() const { return delay_steps_; }

 private:
  void draw(Eigen::Matrix3Xd& noise, Eigen::Index nodes);

  Observation observation_;
  double control_s_;
  long delay_steps_;
  std::mt19937_64 generator_;
  Eigen::Matrix3Xd noise_, before_;  // before_: the places seen last
  std::deque<physics::State> past_;
  physics::State seen_;
};

}  // namespace hydrostat::retarget

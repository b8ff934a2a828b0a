#pragma once

#include <vector>

#include "retarget/contact_loads.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// Measures how far loaded patches slide. A stance is a spell in which a patch bears load; what lets go for less than 1/15 s, as a foot
/// that bounces, is still in it. Source: the design, section 9; the gap is the shortest that contact labels have.
class SlipMeter {
 public:
  /// Steps of `step_s` [s] are to be added; length [m] is L. Both inputs must outlive this.
  SlipMeter(const physics::Scene& scene, const PreparedTarget& prepared, double length, double step_s);

  /// A step that ends at time_s [s] in `state`; `impulse` 3 x P [N s] is what the ground gave the contact points in it.
  void add(double time_s, const physics::State& state, const Eigen::Matrix3Xd& impulse);
  /// Tangential way a stance [m] of all that bears load, whether the target drags it or not.
  double per_stance() const { return all_.mean(); }
  /// Likewise of what the target holds in its place meanwhile.
  double held_per_stance() const { return held_.mean(); }

 private:
  /// Spells of one kind.
  struct Stances {
    double way = 0;  // [m]
    long count = 0;
    std::vector<double> loaded_until_s;  // of each patch
    void add(std::size_t patch, double time_s, double step_s, double speed);
    double mean() const { return count > 0 ? way / static_cast<double>(count) : 0; }
  };

  const physics::Scene& scene_;
  const PreparedTarget& prepared_;
  const double step_s_, least_impulse_;
  Stances all_, held_;
};

}  // namespace hydrostat::retarget

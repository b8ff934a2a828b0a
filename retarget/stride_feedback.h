#pragma once

#include <Eigen/Core>
#include <functional>

#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// Return-map feedback for a creature that drags itself: what a cycle loses by slipping, the next ones win by longer strides.
/// The signals' swing about their means grows by the share of a stride by which the body lags, at most a tenth, smoothed
/// over half a cycle. Legs that step freely need none, what is played once has no next stride, and where there is no travel
/// there is nothing to catch up with: then it changes nothing. Source: Laszlo, van de Panne, Fiume, "Limit Cycle Control and
/// its Application to the Animation of Balancing and Walking", SIGGRAPH 1996, for feedback once a cycle on few parameters.
class StrideFeedback {
 public:
  /// length [m] is L. `feed_forward` as a replay's; it is sampled over one period here and not kept.
  StrideFeedback(const PreparedTarget& plan, double length, Eigen::Index constraints,
                 const std::function<void(double, Eigen::VectorXd&)>& feed_forward);

  bool is_needed() const { return mean_.size() > 0; }
  /// `target` and `body`: the centres of mass [m] after a control step of `seconds`.
  void follow(const Eigen::Vector3d& target, const Eigen::Vector3d& body, double seconds);
  /// Scales the swing of `activation`, E.
  void apply(Eigen::VectorXd& activation) const;
  double gain() const { return gain_; }

 private:
  Eigen::Isometry3d cycle_ = Eigen::Isometry3d::Identity();
  double period_s_ = 0, gain_ = 0;
  Eigen::VectorXd mean_;  // E, empty where it is not needed
};

}  // namespace hydrostat::retarget

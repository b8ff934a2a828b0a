#pragma once

#include <Eigen/Core>
#include <functional>

#include "retarget/best_fit_rotation.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// Return-map feedback for a creature that drags itself: what a cycle loses by slipping, the next ones win by longer strides.
/// The signals' swing about their means grows by the share of a stride by which the body lags, at most a tenth, smoothed
/// over half a cycle. Where its strides come from stretching and shortening it steers too: it bends to one side while it
/// stretches and to the other while it shortens, so that both ends, each in its turn on the way, turn to the heading that
/// brings the body back to its path within some strides; what is bent as far as it may be strides as planned, for longer
/// strides would take the bend's effect. Legs that step freely need none, what is played once has no next stride, and where
/// there is no travel there is nothing to catch up with: then it changes nothing. Source: Laszlo, van de Panne, Fiume, "Limit
/// Cycle Control and its Application to the Animation of Balancing and Walking", SIGGRAPH 1996, for feedback once a cycle on
/// few parameters.
class StrideFeedback {
 public:
  /// length [m] is L, constraints 2 x E are the pairs of nodes. `feed_forward` as a replay's; it is sampled over one period here
  /// and not kept.
  StrideFeedback(const PreparedTarget& plan, double length, const Eigen::Matrix2Xi& constraints,
                 const std::function<void(double, Eigen::VectorXd&)>& feed_forward);

  bool is_needed() const { return mean_.size() > 0; }
  bool steers() const { return bend_.size() > 0; }
  /// `fit`: from the target to the body, after a control step of `seconds`.
  void follow(const RigidFit& fit, double seconds);
  /// Changes `activation`, E, of a time [s].
  void apply(double time_s, Eigen::VectorXd& activation) const;
  double gain() const { return gain_; }
  /// [rad] about y, from one end of the body to the other, between the longest body and the shortest.
  double steering() const { return steering_; }

 private:
  void learn_to_steer(const Motion& target, const Eigen::Vector3d& stride, const Eigen::Matrix2Xi& constraints);
  double stretch_at(double time_s) const;

  Eigen::Isometry3d cycle_ = Eigen::Isometry3d::Identity();
  double period_s_ = 0, gain_ = 0, steering_ = 0, most_steering_ = 0;
  Eigen::VectorXd mean_;     // E, empty where it is not needed
  Eigen::VectorXd bend_;     // E, activations that bend the body by 1 rad about y; empty where it does not steer
  Eigen::VectorXd stretch_;  // of a period's frames: how long the body is, -1 shortest, 1 longest
};

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/Core>

#include "physics/body.h"
#include "retarget/best_fit_rotation.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// How far a body is from its path, seen from the target's own heading: turn about y [rad], then x and z [m].
using WayError = Eigen::Vector3d;

/// Feedback once a cycle on the way of a loop: of what drags itself, and of legs that lose theirs, on a slope. Its handles
/// bend the body sideways, as a whole and the ends against each other, each with a time course that is zero where a cycle
/// begins and ends. How a handle turns and moves a body that slides is not known from its build: it is measured, with a
/// cycle of a model's free motion for each of them. From then on every cycle's handles are those that leave the least of the
/// error over the cycles ahead, by damped least squares within their bound; what turns the body anew in every cycle is estimated with it.
/// After a cycle that went otherwise than foreseen, by more than 5 % of L (of what leaps, 15 % of its stride) and more than half of what
/// the handles were to do, they rest for one and their bound is halved; it grows again while cycles go as foreseen.
/// Source: Laszlo, van de Panne, Fiume, "Limit Cycle Control and its Application to the Animation of Balancing and Walking",
/// SIGGRAPH 1996: the response of a cycle by finite differences, and its inverse once a cycle. The estimate of the drift and
/// the cycles ahead are ours.
class ReturnMap {
 public:
  static constexpr int kHandles = 6;
  using Handles = Eigen::Matrix<double, kHandles, 1>;
  using Answers = Eigen::Matrix<double, 3, kHandles + 2>;

  /// length [m] is L. Of what is played once it never wants to learn and changes nothing.
  ReturnMap(const PreparedTarget& plan, double length, const physics::Body& body);

  /// Of a fit from the target to the body, `cycles` after the start.
  WayError way_error(const RigidFit& fit, long cycles) const;
  /// Takes note of the error at the end of a cycle, of each in turn from the first on. Once it has learned it sets the
  /// handles for the next.
  void end_cycle(const WayError& error);
  /// Whether the last cycle went astray by so much that it is worth to learn how to steer. Never again once it was tried.
  bool wants_to_learn() const { return is_drifting_ && !was_tried_; }

  /// The handles with which a model is to go: none for k = 0, else the k-th alone.
  static Handles trial(int k);
  /// Takes the errors of the way of a model that starts as the target does and goes for a cycle by itself (column 0), then,
  /// each time from there, for another with trial(k) (column k + 1). What fell or diverged teaches nothing, and where a model that steps
  /// freely keeps its way there is nothing to steer: its corrector holds the way, and its body has been pushed.
  void learn(const Answers& errors);
  bool has_learned() const { return has_learned_; }

  void set(const Handles& handles) { handles_ = handles; }
  const Handles& handles() const { return handles_; }  // activations
  /// Changes `activation`, E, of a time [s].
  void apply(double time_s, Eigen::VectorXd& activation) const;

 private:
  void steer();

  double length_, period_s_;
  double yaw_;          // [rad] of the target in a cycle
  bool is_dragged_;
  double least_drift_;  // per L, a cycle
  double most_;         // of a handle
  double least_surprise_;  // per L
  bool is_loop_, has_learned_ = false, is_drifting_ = false, was_tried_ = false;
  Eigen::MatrixXd bends_;   // E x 2
  Eigen::Matrix3d counted_ = Eigen::Matrix3d::Identity();  // what of an error is to be made up for
  Eigen::Matrix3d onward_;  // what one cycle makes of the error of the way by itself
  Eigen::Matrix<double, 3, kHandles> response_;
  WayError error_ = WayError::Zero(), drift_ = WayError::Zero();
  Handles handles_ = Handles::Zero();
};

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "retarget/nominal_path.h"
#include "retarget/prepare.h"
#include "retarget/reduced_modes.h"

namespace hydrostat::retarget {

/// What a regulator weighs in every control step: factors on the squares of deviations, RMS over the mass, and of muscles.
struct RegulatorOptions {
  double reach = 0;      // cost to go up to which a deviation is regulated; 0: there is no regulator
  int modes = 150;       // at most
  double place = 1;      // on that of a place [per L]
  double speed = 0.1;    // on that of a speed [per sqrt(g L)]
  double effort = 1e-3;  // on the sum of squared muscles [-]
  double learn = 0.3;    // share of what a step's end was off its prediction that counts as a disturbance of the next [-]; more hums
  double keep = 0.7;     // share of a disturbance that is left a control step later, as it is learned [-]
  double last = 0.5;     // and as the muscles meet it [-]
  bool operator==(const RegulatorOptions&) const = default;
};

/// What a regulator needs to know of a planned motion.
struct RegulatedMotion {
  const physics::Scene& scene;
  const Muscles& muscles;
  const PreparedTarget& prepared;
  const NominalPath& path;
  std::function<void(double time_s, Eigen::VectorXd& activation)> feed_forward;  // E
  double length = 1;  // L [m]
};

/// z of a state off its reference, which `heading` has turned from the motion's first period, 2R. length [m] is L, wave_speed [m/s] sqrt(g L).
Eigen::VectorXd deviation_along(const ReducedModes& modes, const Eigen::Matrix3d& heading, const physics::State& state,
                                const physics::State& reference, double length, double wave_speed);

/// What a deviation from a planned motion is going to cost until it is gone, its muscles being used as well as they can be: z' S z with z
/// as LinearStep has it, S a matrix of each control step. It knows which feet will hold when, so that it tells how to put a foot now for
/// the stance that comes.
class CostToGo {
 public:
  /// S of the time [s].
  const Eigen::MatrixXf& at(double time_s) const { return costs_[step_at(time_s)]; }
  /// Of a disturbance d that lasts (RegulatorOptions::last), beside that: the cost is z' S z + 2 z' at_disturbed d + what z does not change.
  const Eigen::MatrixXf& at_disturbed(double time_s) const { return disturbed_[step_at(time_s)]; }
  /// Of a deviation along the modes at the time [s].
  double of(const Eigen::VectorXd& deviation, double time_s) const { return deviation.dot(at(time_s).cast<double>() * deviation); }
  const ReducedModes& modes() const { return modes_; }
  /// What the plan itself costs beside a deviation z from it: 2 z' pull.
  const Eigen::VectorXf& pull(double time_s) const { return pulls_[step_at(time_s)]; }
  /// The planned state moved by as much as it has to where forces balance (Equilibrium) halfway through the control step that begins at the
  /// time [s]; `heading` turns the motion's first period into the state's.
  physics::State settled(double time_s, const Eigen::Matrix3d& heading, const physics::State& planned) const;
  /// False where a matrix was no number: there is no regulator for such a motion.
  bool is_sound() const { return is_sound_; }

  friend CostToGo find_cost_to_go(const RegulatedMotion& motion, double control_s, const RegulatorOptions& options);

 private:
  std::size_t step_at(double time_s) const;

  ReducedModes modes_;
  bool is_loop_ = false, is_sound_ = true;
  double spacing_s_ = 0;                            // between matrices
  std::vector<Eigen::MatrixXf> costs_, disturbed_;  // of a period or of the run, 2R x 2R
  std::vector<Eigen::VectorXf> pulls_;              // likewise, 2R
  std::vector<Eigen::Matrix3Xd> settling_;          // [m] likewise, 3 x N: from the plan to where forces balance
};

/// What of S, 2R x 2R, counts where only a step's speeds u' are free and its places follow: with P = (a 1, 1), z' = (q, 0) + P u'.
struct CostByStep {
  Eigen::MatrixXd of_speeds;  // R x R: P^T S P
  Eigen::MatrixXd with_step;  // 2R x R: S P
};

/// `advance` is a, the step in units of L / sqrt(g L).
CostByStep by_step(const Eigen::MatrixXd& cost, double advance);

/// Riccati's recursion, backwards over the control steps: S = Q + F' S1 F - F' S1 G (W + G' S1 G)^-1 G' S1 F, and T = C' (S1 + r T1) for
/// a disturbance of each step's end, that is r times as large in the next, with the closed loop C. Steps are linear about moments that
/// balance (Equilibrium): about the plan itself they would turn a body by what its signals leave. By how far such a moment lies off it, the
/// plan lets a body drift by d, and p = C' (S1 d + p1) tells what that costs beside a deviation. A loop begins a second
/// ahead, for what lies further off hardly counts; what is played once stands in the end.
/// Source: Anderson, Moore, "Optimal Control: Linear Quadratic Methods", Prentice Hall, 1990, section 2.4; Bittanti, Colaneri, De Nicolao,
/// "The periodic Riccati equation", in The Riccati Equation, Springer, 1991.
CostToGo find_cost_to_go(const RegulatedMotion& motion, double control_s, const RegulatorOptions& options);

}  // namespace hydrostat::retarget

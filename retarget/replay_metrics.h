#pragma once

#include <vector>

#include "retarget/best_fit_rotation.h"
#include "retarget/contact_loads.h"
#include "retarget/replay.h"
#include "signal/high_pass.h"

namespace hydrostat::retarget {

/// The end of one control step.
struct ControlStep {
  double time_s = 0;
  const physics::State& state;                // of the body
  const physics::State& reference;            // of the target
  const RigidFit& fit;                        // from target to body, by mass
  const Eigen::VectorXd& activation;          // E, as it was held
  const Eigen::VectorXd& feedback;            // E, of that all that is not the signals
  const Eigen::VectorXd& correction;          // of the muscles, an activation each
  const physics::Impulses& impulses;          // of the whole step
  const std::vector<ContactState>& touching;  // P
};

/// What is measured of a replay while it runs, but for what slips. Keeps sums and courses; the report's figures stand in figures().
class ReplayMetrics {
 public:
  /// Room for `most_steps` control steps of `control_s` [s]. The input must outlive this.
  ReplayMetrics(const ReplayInput& input, double control_s, long most_steps, const physics::State& start);

  void add(const ControlStep& step);
  /// All figures but those of a fall and of the clock.
  ReplayReport figures() const;
  /// One entry for every step that was added.
  ReplayCourse course() const;

 private:
  /// A mean in the making.
  struct Mean {
    double sum = 0;
    long count = 0;
    void add(double value) { sum += value, ++count; }
    double value() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
  };

  /// How far points move about their mean places.
  struct Range {
    Eigen::Matrix3Xd sum;
    Eigen::VectorXd squares;
    long count = 0;
    void add(const Eigen::Matrix3Xd& points);
    Eigen::VectorXd squared() const;  // mean square distance of each [m2]
  };

  void balance_momentum(const ControlStep& step);
  void compare_shape(const ControlStep& step);
  void compare_with_clip(const ControlStep& step);
  void compare_way(const ControlStep& step);
  void watch_points(const ControlStep& step);
  void watch_patches(const ControlStep& step);
  void write_course(const ControlStep& step);
  void measure_way(ReplayReport& report) const;
  void measure_drift(ReplayReport& report) const;
  void measure_apex(ReplayReport& report) const;
  void measure_style(ReplayReport& report) const;

  const ReplayInput& input_;
  const double control_s_, length_, weight_, period_s_, rest_volume_;
  const ContactThresholds thresholds_;
  const Eigen::VectorXd mass_shares_, even_shares_;  // N; skin points
  const MotionCurve clip_curve_;
  const long clip_every_;  // steps between comparisons with the clip
  const Eigen::Vector3d start_com_;
  long steps_ = 0;
  Eigen::Vector3d momentum_, spin_;  // at the end of the last step
  ReplayReport report_;              // largest values so far
  ReplayCourse course_;
  Mean shape_, world_, clip_shape_, sole_gap_, feedback_, correction_, buzz_;
  signal::HighPass fast_;
  Range range_, clip_range_;  // of the skin within the body, as it lies in the clip's first frame
  double highest_;
  std::vector<double> cycle_, drift_, heading_;  // from the third cycle on
};

}  // namespace hydrostat::retarget

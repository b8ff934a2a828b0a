#pragma once

#include <array>
#include <vector>

#include "retarget/simulation.h"

namespace hydrostat::retarget {

/// Of what is written down of a body that splits: all its parts apart from the start, copies of a node lying on each other until
/// they part. Empty, where it does not split: the body as it is.
struct WrittenNodes {
  Eigen::VectorXi node;   // of the body as it now is
  Eigen::VectorXd share;  // [-] of that node's mass
  Eigen::VectorXi edges;  // of each constraint: the whole body's
};

/// What a simulation writes down: frames of the motion, course, trace.
template <int Dim>
class SimulationRecord {
 public:
  /// `body`: as it is written.
  SimulationRecord(const ScenarioOf<Dim>& scenario, const SimulationOptions& options, const physics::BodyOf<Dim>& body);

  /// The nodes' numbers from now on; to be called first of all.
  void follow(WrittenNodes written) { written_ = std::move(written); }
  /// Sums up what acted in a step, for the trace; `hold_moment` [N m s] about the local origin.
  void add_step(const physics::ImpulsesOf<Dim>& impulses, const std::vector<int>& held, const physics::SpinOf<Dim>& hold_moment,
                const Eigen::VectorXd& activation);
  bool row_is_full() const { return steps_in_row_ == options_.steps_per_row; }
  /// The trace's row 0, and a row that ends there.
  void begin_trace(const physics::StateOf<Dim>& state, const Eigen::VectorXd& activation);
  void write_row(double time_s, const physics::StateOf<Dim>& state);
  /// Adds a frame: time, energies and whatever SimulationCourse has of it, in its order without the COM.
  void write_frame(const physics::StateOf<Dim>& state, const Eigen::Vector3d& com, const std::array<double, 9>& figures);
  /// Hands all over.
  void finish(double rate_hz, Simulation& simulation);

 private:
  Eigen::VectorXd of_nodes(const physics::PointsOf<Dim>& points) const;
  Eigen::VectorXd shares_of(const physics::PointsOf<Dim>& forces) const;
  Eigen::VectorXd of_edges(const Eigen::VectorXd& activation) const;

  const ScenarioOf<Dim>& scenario_;
  const SimulationOptions& options_;
  WrittenNodes written_;
  Trace trace_;
  Eigen::Index rows_ = 0;
  int steps_in_row_ = 0;
  Eigen::VectorXd contact_, effect_, correction_;  // [N s] 3N, sums over a row
  physics::SpinOf<Dim> contact_moment_ = physics::SpinOf<Dim>::Zero(), effect_moment_ = physics::SpinOf<Dim>::Zero();
  Eigen::VectorXd activation_;
  std::vector<Eigen::VectorXd> frames_;
  std::vector<physics::PointsOf<3>> velocities_;
  std::vector<physics::PointsOf<Dim>> travels_;
  std::vector<std::array<double, 9>> course_;
  std::vector<Eigen::Vector3d> com_;
};

}  // namespace hydrostat::retarget

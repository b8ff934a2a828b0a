#pragma once

#include "retarget/motion.h"
#include "retarget/run_report.h"
#include "retarget/scenario.h"
#include "retarget/trace.h"

namespace hydrostat::retarget {

struct SimulationOptions {
  physics::Method method = physics::Method::kExplicit;
  double dt_s = 1.0 / 240;
  double begin_s = 0;  // when the start is: waves, pushes, moves and clamps count from 0
  double duration_s = 2;
  double frame_rate_hz = 60;  // of the motion, at most
  bool figures = true;  // false: the motion alone, without report and course
  bool velocities = false;
  bool trace = false;
  int steps_per_row = 1;  // of the trace
};
/// Which value of the options breaks which rule, empty when all is well.
std::string broken_rule(const SimulationOptions& options);

/// Time courses, one entry a frame of the motion.
struct SimulationCourse {
  Eigen::VectorXd time_s;
  Eigen::Matrix3Xd com;                                  // [m]
  Eigen::VectorXd kinetic_j, elastic_j, gravity_j, work_j;  // work: done on the body since the start
  Eigen::VectorXd volume_ratio, penetration_m, mean_activation;
  Eigen::VectorXd contact_weights;  // sizes of the forces at all contact points, added up
};

/// What came of a scene. In 2D, z = 0. Course, report and trace are of the world, moments about its origin. Motion, velocities and
/// trace are those of the body of written_scenario.
struct Simulation {
  Motion motion;                         // nodes, 3N x F, about the scenario's own origin
  std::vector<Motion> obstacle_travels;  // 3 x F, of each obstacle from where the scene has it
  SimulationCourse course;
  SimulationReport report;
  Trace trace;  // filled where asked
  physics::StepWork work;                      // of the stepper
  std::vector<physics::PointsOf<3>> velocities;  // [m/s] 3 x N of each frame, filled where asked
};

/// Lets the body go from its start: nothing acts but what the scenario holds. Stops where the simulation diverges; all that is
/// handed over ends before that step. The options must break no rule.
template <int Dim>
Simulation simulate(const ScenarioOf<Dim>& scenario, const SimulationOptions& options);

/// The scenario with its body as a simulation is written down: of one that can split with all its parts apart from the start, copies of
/// a node lying on each other until they part. The first nodes are the whole body's. Any other scenario as it is.
template <int Dim>
ScenarioOf<Dim> written_scenario(const ScenarioOf<Dim>& scenario);

/// Every effect that a scene can have: whether it is on, why, and what it costs, timed here on the scene's own body.
template <int Dim>
std::vector<EffectReport> effects_of(const ScenarioOf<Dim>& scenario, const SimulationOptions& options);

}  // namespace hydrostat::retarget

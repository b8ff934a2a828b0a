#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hydrostat::retarget {

// The figures of one run, grouped and named as in report.json (README, "report.json"). "_length" is per L, "_size" per D.

struct SourceReport {
  std::string file, sha256, clip, root_motion;
  double duration_s = 0, rate_hz = 0, scale = 1;
  std::optional<std::array<double, 3>> scene_origin_m = {};  // of a creature: where its scene's places count from, in its motion
};

struct BodyReport {
  int nodes = 0, elements = 0, constraints = 0, vertices = 0, pieces = 0, bridged_cells = 0, copied_cells = 0;
  double mass_kg = 0, length_m = 0, size_m = 0, youngs_modulus_pa = 0;
};

struct CouplingReport {
  double error_rms_length = 0, error_max_length = 0;
};

struct PreparationReport {
  double smooth_shift_rms_length = 0, foot_shift_rms_length = 0, volume_shift_rms_length = 0, momentum_shift_rms_length = 0;
  double total_shift_rms_length = 0;
  double missing_wrench_rms_mg = 0, missing_wrench_max_mg = 0, flight_s = 0;
  double min_jacobian = 0, volume_error_rms = 0;
};

struct InverseReport {
  double miss_rms_length = 0, root_residual_mg = 0, kkt_residual = 0, saturated = 0, max_strain = 0, p95_strain = 0,
         limit = 0;
};

struct SignalsReport {
  std::string kind;  // "loop" or "one_shot"
  double period_s = 0, error_rms_l0 = 0;
  int count = 0, harmonics = 0;
};

/// One free simulation.
struct ReplayReport {
  double cycles = 0, duration_s = 0;
  bool fell = false;
  double fall_time_s = 0;
  std::string fall_cause;
  double shape_rms_length = 0, clip_shape_rms_length = 0, world_rms_length = 0;
  double drift_per_cycle_length = 0, heading_deg_per_cycle = 0;  // not a number of a loop seen for two cycles or fewer, which does not tell them
  double travel_per_cycle_length = 0, clip_travel_per_cycle_length = 0;
  double slip_per_stance_length = 0, held_slip_per_stance_length = 0;  // of all that bears load; of what the target holds
  double sole_gap_length = 0, penetration_max_size = 0, volume_error_max = 0;
  double momentum_residual_mg = 0, angular_residual_mgl = 0, external_assist_mg = 0;
  double external_assist_time_s = 0;  // at which it was most
  int inverted_elements = 0;  // the most in any control step
  int guard_steps = 0;
  double feedback_rms = 0;  // activations that are not the signals', of all constraints
  double correction_rms = 0, correction_buzz_rms = 0;  // the corrector's of them, of muscles; what of these is faster than 10 Hz
  double style_range = 1, style_range_least = 1;       // how far the skin moves within the body over how far the clip's does
  double real_time_factor = 0;
  double apex_rise_length = 0, clip_apex_rise_length = 0;  // of the COM over its height at the start, per L
};

/// What polish made of the signals: RMS of the correction, and how long the open loop stays up, at most as long as it was let go.
struct PolishReport {
  int rounds = 0;  // replays from which it learned
  double correction_rms_before = 0, correction_rms_after = 0;
  double open_loop_s_before = 0, open_loop_s_after = 0;
};

/// Faces of a seam that broke in one step.
struct BreakReport {
  double time_s = 0;
  int seam = 0;    // as the scene counts them, from 0
  int faces = 0;
  int pieces = 1;  // of the body after the step
};

/// A scene's simulation, without a clip. Energies are per m g L with g = 9.81 m/s2.
struct SimulationReport {
  int dimension = 3;
  double duration_s = 0;
  bool diverged = false;
  double diverged_time_s = 0;
  std::string diverged_cause;
  double energy_start_mgl = 0, energy_end_mgl = 0;  // kinetic, elastic and in the field of gravity
  double work_mgl = 0;                              // by activations, pushes and moving obstacles
  double energy_excess_mgl = 0;                     // the most by which energy exceeded its start and the work
  double momentum_residual_mg = 0, angular_residual_mgl = 0, external_assist_mg = 0;
  double volume_error_max = 0, volume_error_end = 0, penetration_max_size = 0;
  double self_penetration_max_size = 0;  // of the body in itself
  int inverted_elements = 0, inverted_elements_end = 0;  // the most in any step; at the end
  int guard_steps = 0;                                   // in which another method took over
  double travel_length = 0;  // of the COM over the ground's plane
  double speed_max_m_s = 0, speed_end_m_s = 0;  // of the fastest node
  double ms_per_sim_s = 0, real_time_factor = 0;
  std::vector<BreakReport> fractures;  // in the order of time
  int pieces_end = 1;                  // that share no node
};

struct EffectReport {
  std::string name, state, reason;  // state: "on" or "off"
  double ms_per_sim_s = 0;
};

struct AccuracyReport {
  std::string method, element, material;
  double dt_s = 0, estimated_error_length = 0;
  double estimated_span_s = 0;  // that the estimate is about: with contact of every window, else of the run; 0: not told
  double max_error_length = 0;  // that was asked for; 0: none was
  // Where one was: share of the counted work of the most accurate setting that was tried; processor time [ms] of a simulated second, of
  // the chosen and of that one.
  double work_saved = 0, ms_per_sim_s = 0, finest_ms_per_sim_s = 0;
  bool is_met() const { return max_error_length == 0 || estimated_error_length <= max_error_length; }
};

/// Of a replay on another control mesh than the creature was solved on.
struct LevelReport {
  int nodes = 0, solved_nodes = 0;
  double work_ms = 0;    // counted, a frame of 1/60 s
  double budget_ms = 0;  // 0: none was asked for
};

struct RunReport {
  SourceReport source;
  BodyReport body;
  CouplingReport coupling;
  PreparationReport preparation;
  InverseReport inverse;
  SignalsReport signals;
  std::optional<ReplayReport> naive, open_loop, closed_loop;
  std::optional<SimulationReport> simulation;  // in place of all that tells of a clip
  std::vector<EffectReport> effects;
  AccuracyReport accuracy;
  std::optional<PolishReport> polish;  // of signals that were polished
  std::optional<LevelReport> level;
  std::vector<std::pair<std::string, double>> timing_s;  // per stage, in order
  std::vector<std::string> warnings;
  bool outcome_ok = true;  // false: fell, diverged or short of what was asked (exit code 3)
};

}  // namespace hydrostat::retarget

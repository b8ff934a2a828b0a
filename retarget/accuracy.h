#pragma once

#include <optional>
#include <string>
#include <vector>

#include "retarget/simulation.h"

namespace hydrostat::retarget {

/// How a body is stepped.
struct StepSetting {
  physics::Method method = physics::Method::kExplicit;
  double dt_s = 1.0 / 240;
};

/// A stretch of a motion that a setting has to repeat from its start.
template <int Dim>
struct WindowOf {
  double begin_s = 0, duration_s = 0;  // a whole number of AccuracyOptions::frame_s
  physics::StateOf<Dim> start;
};

struct AccuracyOptions {
  double duration_s = 1;           // of the motion that is looked at, at most
  double step_frame_s = 1.0 / 30;  // which steps that are tried fill; fills frame_s
  double frame_s = 1.0 / 30;       // between the places that are compared: a whole number of every setting's steps
  double window_s = 0.1;           // with contact, whose paths part in any method
  int windows = 8;                 // likewise, evenly over the motion
  int fineness = 4;                // the reference's substeps in one of explicit's own
};

/// How a body that can split does so over a span.
struct Breaking {
  int pieces = 0;                  // in which it ends; 0: it cannot split
  double first_s = 0, last_s = 0;  // when the first and the last of what broke did; 0 where nothing has
  std::vector<int> faces;          // of each seam up to the last that broke, how many broke

  bool is_broken() const { return !faces.empty(); }
};
/// Whether two bodies end in as many pieces, with as many faces of each seam broken, the first and the last of them `within_s` of each
/// other.
bool break_alike(const Breaking& a, const Breaking& b, double within_s);

/// What is to be repeated, as it truly goes: by an accurate method in short steps.
template <int Dim>
struct ReferenceOf {
  ScenarioOf<Dim> scenario;
  AccuracyOptions options;
  std::vector<WindowOf<Dim>> windows;          // one, of the whole motion, where nothing touches
  physics::ContactPointsOf<Dim> skin;          // P points of the scenario's body by which motions are compared
  std::vector<physics::PointsOf<Dim>> places;  // of the skin in every frame of every window [m]
  StepSetting setting;                         // that it was made by
  double own_error_m = 0;                      // distance to the same method in steps twice as long
  StepSetting check;                           // the second method
  double check_distance_m = 0;                 // to the motion by it
  double check_error_m = 0;                    // how far that one moves when its steps are halved
  double work_ms = 0;                          // counted
  Breaking breaking;                           // within options.duration_s
  bool is_breaking_settled = false;            // steps twice as long break the body alike

  /// No error below it can be told [m, RMS]: the reference's own, or, where the second method does not agree within what
  /// both leave open, its distance.
  double uncertainty_m() const;
};

/// Follows the motion from the scenario's start, of a body that splits until it first breaks; with contact its windows start on
/// the way. The second method is only asked
/// where `is_checked`.
template <int Dim>
ReferenceOf<Dim> make_reference(const ScenarioOf<Dim>& scenario, const AccuracyOptions& options, bool is_checked = true);
/// The same for windows and skin that are given.
template <int Dim>
ReferenceOf<Dim> make_reference(const ScenarioOf<Dim>& scenario, const AccuracyOptions& options,
                                std::vector<WindowOf<Dim>> windows, physics::ContactPointsOf<Dim> skin,
                                bool is_checked = true);

/// One point of the curve: what a setting costs and how far it is from the truth.
struct AccuracyRow {
  std::string method, element, material;
  int nodes = 0;
  double dt_s = 0;
  double iterations = 0;  // of the solver a step: substeps, Newton's, or those of L-BFGS
  int harmonics = 0;      // of a creature's signals
  double error_rms_m = 0, error_rel_length = 0;
  double ms_per_sim_s = 0;                       // as the clock of this thread has it
  double work_ms = 0;                            // counted, a simulated second: what choices go by
  // Both of what breaks are of all of options.duration_s: its parts touch each other.
  // Of what ran away these are not told (NaN), nor is its time.
  double volume_error = 0;                       // the whole body's, at most
  double momentum_error = 0, angular_error = 0;  // what booked impulses do not explain: m g, m g L
  bool stable = true;                            // finite, and no further away than L
  bool falls = false;                            // of a creature: its closed loop does not stay up; never stable
  // Of a creature: of the skin in its closed loop, from that of the finest setting; where it is larger, the error is it. Below 0
  // where that was not tried.
  double loop_error_m = -1;
  Breaking breaking;         // within the reference's options.duration_s
  bool is_refused = false;  // for what its closed loop or its whole replay came to, or for it breaks otherwise than the reference
};

/// Repeats the reference's windows. The scenario may hold the same body in another mesh: starts are then carried over.
template <int Dim>
AccuracyRow measure_error(const ReferenceOf<Dim>& reference, const ScenarioOf<Dim>& scenario, const StepSetting& setting);

/// The same with the windows and the skin's points as they are on the scenario's own mesh.
template <int Dim>
AccuracyRow measure_error(const ReferenceOf<Dim>& reference, const ScenarioOf<Dim>& scenario, const StepSetting& setting,
                          const std::vector<WindowOf<Dim>>& windows, const physics::ContactPointsOf<Dim>& skin);

/// Methods and steps that are tried on a body, each method's from long steps to short ones; steps are whole parts of
/// `frame_s`.
template <int Dim>
std::vector<std::vector<StepSetting>> settings_to_try(const physics::SceneOf<Dim>& scene, double frame_s);

struct EstimatedError {
  double error_length = 0;  // per L, RMS over the skin and time
  double span_s = 0;        // of the motion that it is about, from its start: with contact, of every window from its own
  StepSetting finer;         // what it was held against
  Breaking breaking, finer_breaking;  // of a body that can split: by the setting and by that
};

/// The error of a setting where no bound was asked for, from few runs: its distance to the same method in half steps, doubled,
/// or to an accurate method where its own limit is another body (xpbd, spring), far (euler) or out of reach (explicit on a stiff
/// body). Where nothing touches it is that of the whole run (until it breaks), or, where that would cost several times what the
/// run does, of its first part. How it breaks is held against the other method as far into the run as that costs no more.
template <int Dim>
EstimatedError estimated_error(const ScenarioOf<Dim>& scenario, const SimulationOptions& options);

}  // namespace hydrostat::retarget

#include "cli/asked_accuracy.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <optional>

#include "cli/command_line.h"
#include "cli/number_option.h"
#include "retarget/performed_scenario.h"
#include "retarget/step_cost.h"

namespace hydrostat::cli {
namespace {

// Three points of the curve: what an eye forgives, what it does not see, what a measurement wants [per L].
const std::map<std::string, double> kGrades{{"draft", 0.05}, {"standard", 0.01}, {"final", 0.001}};

constexpr double kOverFloor = 1.5;                      // of the reference's own error [-]: what a grade asks for at least
constexpr double kFinestSeconds = kControlSeconds / 8;  // of the closed loop that choices are held against
// A creature's draft is there soon: an error from here on is told without a second integrator, against a closed loop in longer
// steps, with all harmonics.
constexpr double kRough = 0.03;
constexpr double kRoughFinestSeconds = kControlSeconds / 2;

/// What a choice costs beside the most accurate row; nothing where nothing was chosen.
void tell_saved(const std::vector<retarget::AccuracyRow>& rows, int choice, int finest, retarget::AccuracyReport& report) {
  if (choice < 0 || finest < 0) return;
  const retarget::AccuracyRow &row = rows[static_cast<std::size_t>(choice)], &most = rows[static_cast<std::size_t>(finest)];
  report.work_saved = 1 - row.work_ms / most.work_ms;
  report.ms_per_sim_s = row.ms_per_sim_s;
  report.finest_ms_per_sim_s = most.ms_per_sim_s;
}

/// The rows within an error, least work first.
std::vector<int> by_work(const std::vector<retarget::AccuracyRow>& rows, double most_m) {
  std::vector<int> order;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].stable && rows[k].error_rms_m <= most_m) order.push_back(static_cast<int>(k));
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return rows[static_cast<std::size_t>(a)].work_ms < rows[static_cast<std::size_t>(b)].work_ms;
  });
  return order;
}

retarget::Replay closed_loop(const retarget::Performer& performer, const retarget::SignalSet& signals,
                             const retarget::StepSetting& setting) {
  retarget::ReplayOptions options;
  take_steps(options, setting);
  return retarget::perform_briefly(performer, signals, options);
}

bool is_up(const retarget::Replay& replay) {
  return !replay.report.fell && replay.termination == physics::Termination::kDone;
}

/// [m] of the skin, on this control mesh from the finest's closed loop on its own; without end where it falls and the finest
/// does not.
double closed_loop_error(const retarget::Replay& finest, const retarget::Performer& of_finest,
                         const retarget::Performer& performer, const retarget::SignalSet& signals,
                         const retarget::StepSetting& setting) {
  const retarget::Replay replay = closed_loop(performer, signals, setting);
  if (is_up(finest) && !is_up(replay)) return HUGE_VAL;
  return retarget::skin_distance(of_finest, finest.motion, performer, replay.motion);
}

/// What its closed loop came to is a row's error where it is the larger. Whether that refuses the row.
bool refuses(double loop_m, double most_m, double length, retarget::AccuracyRow& row) {
  row.falls = loop_m == HUGE_VAL;
  if (row.falls) {
    row.stable = false;
  } else {
    row.loop_error_m = loop_m;
    row.error_rms_m = std::max(row.error_rms_m, loop_m);
    row.error_rel_length = row.error_rms_m / length;
  }
  row.is_refused = row.falls || row.error_rms_m > most_m;
  return row.is_refused;
}

/// Tells how many harmonics a creature's row has, and adds what playing them takes.
void add_signals(retarget::AccuracyRow& row, const retarget::SignalSet& signals, int harmonics) {
  row.harmonics = harmonics;
  const double ms = retarget::counted_ms_of_signals(signals.activation.channels(), harmonics) / row.dt_s;
  row.work_ms += ms;
  row.ms_per_sim_s += ms;
}

/// The candidate of the least error, where none keeps what was asked for; what is within it and was refused fell or strayed in the end.
void take_nearest(ChosenStep& chosen, double floor_m, double length) {
  const retarget::AccuracyRow* nearest = nullptr;
  for (const int k : chosen.candidates) {
    const retarget::AccuracyRow& row = chosen.curve.rows[static_cast<std::size_t>(k)];
    const bool has_strayed = row.is_refused && row.error_rms_m <= chosen.report.max_error_length * length - floor_m;
    if (row.stable && !has_strayed && (!nearest || row.error_rms_m < nearest->error_rms_m)) nearest = &row;
  }
  chosen.curve.recommended = -1;
  chosen.report.work_saved = chosen.report.ms_per_sim_s = chosen.report.finest_ms_per_sim_s = 0;
  if (!nearest) return;
  chosen.setting = {*physics::method_named(nearest->method), nearest->dt_s};
  chosen.report.estimated_error_length = (nearest->error_rms_m + floor_m) / length;
}

/// The first of the candidates from the present one on whose closed loop stays near the finest one's, and up; the finest at
/// the latest.
void take_candidate(ChosenStep& chosen, const retarget::Performer& performer, const retarget::SignalSet& signals) {
  const double floor_m = chosen.reference->uncertainty_m();
  const double most_m = chosen.report.max_error_length * performer.length - floor_m;
  std::vector<retarget::AccuracyRow>& rows = chosen.curve.rows;
  for (;; ++chosen.candidate) {
    chosen.curve.recommended = chosen.candidates[chosen.candidate];
    retarget::AccuracyRow& row = rows[static_cast<std::size_t>(chosen.curve.recommended)];
    chosen.setting = {*physics::method_named(row.method), row.dt_s};
    const bool is_last = chosen.candidate + 1 == chosen.candidates.size();
    const bool is_finest = is_last && chosen.setting.method == chosen.reference->setting.method;
    const double loop_m = is_finest ? 0 : closed_loop_error(*chosen.finest, performer, performer, signals, chosen.setting);
    const bool is_refused = refuses(loop_m, most_m, performer.length, row) && !is_finest;
    chosen.report.estimated_error_length = row.falls ? HUGE_VAL : (row.error_rms_m + floor_m) / performer.length;
    tell_saved(rows, chosen.curve.recommended, chosen.candidates.back(), chosen.report);
    if (is_last && is_refused) take_nearest(chosen, floor_m, performer.length);
    if (is_last || !is_refused) return;
  }
}

/// [m] that was asked for, of a grade at least what can be told.
double most_told(const AskedAccuracy& asked, const std::string& command, double floor_m, double length) {
  const double most = asked.most(command), floor = floor_m / length;
  if (!asked.grade.empty()) return length * std::max(most, kOverFloor * floor);
  if (most > floor) return length * most;
  char text[200];
  std::snprintf(text, sizeof text, "the reference itself is only known within %.2g %% of L, so that %.2g %% cannot be told",
                100 * floor, 100 * most);
  throw UsageError(command, "option --max-error", text, "Ask for a larger error.");
}

/// Which rows of a curve are of the whole run.
template <int Dim>
std::string whole_in_words(const retarget::ReferenceOf<Dim>& whole, double first_s) {
  char text[240];
  std::snprintf(text, sizeof text,
                ", over %.3g s of the run for the chosen setting and what does less work within the error over the first %.3g s, over "
                "these alone for the others",
                whole.windows.front().duration_s, first_s);
  return text;
}

std::string in_words(const retarget::StepSetting& setting) {
  char text[80];
  std::snprintf(text, sizeof text, "'%s' in steps of %.3g s", physics::name_of(setting.method).c_str(), setting.dt_s);
  return text;
}

std::string in_words(const retarget::Breaking& breaking) {
  if (!breaking.is_broken()) return "does not break";
  char text[120];
  const int faces = std::accumulate(breaking.faces.begin(), breaking.faces.end(), 0);
  std::snprintf(text, sizeof text, "breaks from %.3g to %.3g s, at %d face%s, into %d piece%s", breaking.first_s, breaking.last_s, faces,
                faces == 1 ? "" : "s", breaking.pieces, breaking.pieces == 1 ? "" : "s");
  return text;
}

/// What is known of a motion after its body has broken; empty where it does not.
template <int Dim>
std::string told_after_break(const retarget::ReferenceOf<Dim>& reference) {
  if (!reference.breaking.is_broken()) return "";
  char text[240];
  std::snprintf(text, sizeof text,
                reference.is_breaking_settled
                    ? "accuracy: the body breaks at %.3g s; the error is that of the motion before, after it only that the same breaks at the same "
                      "time, within %.2g s, is held"
                    : "accuracy: the body breaks at %.3g s, and in what way hangs on the step in the shortest ones, too; nothing is told of the "
                      "motion after it",
                reference.breaking.first_s, reference.options.frame_s);
  return text;
}

}  // namespace

double AskedAccuracy::most(const std::string& command) const {
  return grade.empty() ? parse_share(max_error, command, "--max-error") : kGrades.at(grade);
}

template <int Dim>
ChosenStep choose_step(const AskedAccuracy& asked, const std::string& command, const retarget::ReferenceOf<Dim>& reference,
                       std::optional<physics::Method> only, double duration_s) {
  const double length = reference.scenario.length;
  double floor_m = reference.uncertainty_m();
  double most_m = most_told(asked, command, floor_m, length);
  retarget::StepChoice choice = retarget::choose_setting(reference, most_m, only);
  const retarget::ReferenceOf<Dim>* truth = &reference;
  ChosenStep chosen;
  chosen.report.estimated_span_s = reference.windows.front().duration_s;
  chosen.curve.truth = "Errors are distances to '" + physics::name_of(reference.setting.method) + "' in much shorter steps";
  const std::optional<retarget::ReferenceOf<Dim>> whole = retarget::reference_of_whole(reference, duration_s);
  if (whole) {
    truth = &*whole;
    floor_m = whole->uncertainty_m();
    most_m = most_told(asked, command, floor_m, length);
    choice = retarget::choose_for_whole(*whole, choice, most_m, only);
    chosen.curve.truth += whole_in_words(*whole, chosen.report.estimated_span_s);
    chosen.report.estimated_span_s = whole->windows.front().duration_s;
  }
  chosen.curve.truth += ".";
  chosen.setting = choice.setting;
  chosen.report.max_error_length = most_m / length;
  chosen.report.estimated_error_length = choice.estimated_error_m / length;
  if (choice.row.is_refused) {
    chosen.report.estimated_error_length = HUGE_VAL;
    chosen.warnings.push_back(breaks_otherwise(choice.setting, choice.row.breaking, truth->setting, truth->breaking));
  } else if (const std::string after = told_after_break(*truth); !after.empty()) {
    chosen.warnings.push_back(after);
  }
  chosen.curve.subject = "this body";
  chosen.curve.rows = choice.tried;
  chosen.curve.recommended = choice.is_met ? choice.index : -1;
  chosen.curve.max_error = most_m / length;
  chosen.curve.is_counted = true;
  chosen.curve.floor = floor_m / length;
  tell_saved(choice.tried, chosen.curve.recommended, retarget::most_accurate(choice.tried), chosen.report);
  return chosen;
}

ChosenStep choose_step(const AskedAccuracy& asked, const std::string& command, const retarget::Performer& performer,
                       const retarget::SignalSet& signals, std::optional<physics::Method> only) {
  retarget::AccuracyOptions options;
  options.step_frame_s = kControlSeconds;
  const bool is_rough = asked.most(command) >= kRough;
  const retarget::ReferenceOf<3> reference = retarget::performed_reference(performer, signals, options, !is_rough);
  ChosenStep chosen = choose_step(asked, command, reference, only);
  std::vector<retarget::AccuracyRow>& rows = chosen.curve.rows;
  const int harmonics = signals.activation.harmonics();
  for (retarget::AccuracyRow& row : rows) add_signals(row, signals, harmonics);
  if (!chosen.report.is_met()) return chosen;
  // Held against the method of the truth: shorter steps of another would not show what that one errs by.
  const double finest_s = is_rough ? kRoughFinestSeconds : kFinestSeconds;
  chosen.finest = closed_loop(performer, signals, {reference.setting.method, finest_s});
  chosen.report.estimated_span_s = chosen.finest->report.duration_s;
  rows.push_back(
      retarget::measure_error(reference, reference.scenario, {only.value_or(reference.setting.method), finest_s}));
  add_signals(rows.back(), signals, harmonics);
  const int last = static_cast<int>(rows.size()) - 1;
  for (const int k : by_work(rows, chosen.report.max_error_length * performer.length - reference.uncertainty_m())) {
    if (k == last) break;
    chosen.candidates.push_back(k);
  }
  chosen.candidates.push_back(last);
  chosen.reference = reference;
  take_candidate(chosen, performer, signals);
  return chosen;
}

bool strays(const ChosenStep& chosen, const retarget::Replay& run) {
  if (!chosen.finest || !is_up(*chosen.finest)) return false;
  return run.report.world_rms_length > chosen.report.max_error_length + chosen.finest->report.world_rms_length;
}

bool take_next(ChosenStep& chosen, const retarget::Performer& performer, const retarget::SignalSet& signals) {
  if (chosen.candidate + 1 >= chosen.candidates.size()) return false;
  chosen.warnings.push_back("accuracy: by '" + physics::name_of(chosen.setting.method) +
                            "', which does less work within the error for some seconds, the creature fell or strayed in the end");
  chosen.curve.rows[static_cast<std::size_t>(chosen.curve.recommended)].is_refused = true;
  ++chosen.candidate;
  chosen.harmonics = 0;
  take_candidate(chosen, performer, signals);
  return true;
}

template ChosenStep choose_step<2>(const AskedAccuracy&, const std::string&, const retarget::ReferenceOf<2>&,
                                   std::optional<physics::Method>, double);
template ChosenStep choose_step<3>(const AskedAccuracy&, const std::string&, const retarget::ReferenceOf<3>&,
                                   std::optional<physics::Method>, double);

void take_steps(retarget::ReplayOptions& options, const retarget::StepSetting& setting) {
  options.method = setting.method;
  options.steps_per_control = std::max(1, static_cast<int>(std::lround(kControlSeconds / setting.dt_s)));
  options.step_s = kControlSeconds / options.steps_per_control;
}

void cut_harmonics(ChosenStep& chosen, const retarget::Performer& performer, retarget::SignalSet& signals) {
  constexpr int kLeast = 4;
  const int all = signals.activation.harmonics();
  if (!chosen.report.is_met() || !chosen.finest || chosen.report.max_error_length >= kRough) return;
  const double room = (chosen.report.max_error_length - chosen.curve.floor) * performer.length;
  const retarget::AccuracyRow whole = chosen.curve.rows[static_cast<std::size_t>(chosen.curve.recommended)];
  const double playing_ms = retarget::counted_ms_of_signals(signals.activation.channels(), all) / whole.dt_s;
  int kept = all;
  for (const double part : {0.75, 0.5, 0.25}) {
    const int harmonics = std::max(kLeast, static_cast<int>(std::lround(part * all)));
    if (harmonics >= kept) break;
    retarget::AccuracyRow row = retarget::measure_error(
        *chosen.reference, retarget::performed_scenario(performer, signals, harmonics), chosen.setting);
    // It runs the same steps as the whole signals' row: the clock would tell them apart by its noise alone.
    if (whole.work_ms > playing_ms) row.ms_per_sim_s = (whole.ms_per_sim_s - playing_ms) * row.work_ms / (whole.work_ms - playing_ms);
    add_signals(row, signals, harmonics);
    const bool is_within = row.stable && row.error_rms_m <= room;
    const retarget::SignalSet fewer = retarget::with_harmonics(signals, harmonics);
    const bool is_kept = is_within && !refuses(closed_loop_error(*chosen.finest, performer, performer, fewer, chosen.setting),
                                               room, performer.length, row);
    chosen.curve.rows.push_back(row);
    if (!is_kept) break;
    chosen.harmonics = kept = harmonics;
    chosen.curve.recommended = static_cast<int>(chosen.curve.rows.size()) - 1;
    chosen.report.estimated_error_length = row.error_rel_length + chosen.curve.floor;
    tell_saved(chosen.curve.rows, chosen.curve.recommended, chosen.candidates.back(), chosen.report);
  }
  if (kept < all) signals = retarget::with_harmonics(signals, kept);
}

bool take_coarser(ChosenStep& chosen, const retarget::Performer& solved, const retarget::Performer& coarser,
                  const retarget::SignalSet& signals) {
  retarget::AccuracyRow row = retarget::measure_level(*chosen.reference, coarser, signals, chosen.setting);
  add_signals(row, signals, signals.activation.harmonics());
  const double room = (chosen.report.max_error_length - chosen.curve.floor) * solved.length;
  refuses(closed_loop_error(*chosen.finest, solved, coarser, signals, chosen.setting), room, solved.length, row);
  chosen.curve.rows.push_back(row);
  const double error = row.error_rel_length + chosen.curve.floor;
  const retarget::AccuracyRow& present = chosen.curve.rows[static_cast<std::size_t>(chosen.curve.recommended)];
  if (!row.stable || row.is_refused || row.work_ms >= present.work_ms) return false;
  const int finest = chosen.candidates.back();
  chosen.curve.recommended = static_cast<int>(chosen.curve.rows.size()) - 1;
  chosen.report.estimated_error_length = error;
  tell_saved(chosen.curve.rows, chosen.curve.recommended, finest, chosen.report);
  return true;
}

std::string breaks_otherwise(const retarget::StepSetting& setting, const retarget::Breaking& breaking, const retarget::StepSetting& finer,
                             const retarget::Breaking& finer_breaking) {
  const std::string advice = finer.method == setting.method ? "take a smaller dt_s or --max-error"
                                                            : "take a smaller --max-error or --method " + physics::name_of(finer.method);
  return "accuracy: by " + in_words(setting) + " the body " + in_words(breaking) + ", by " + in_words(finer) + " it " +
         in_words(finer_breaking) + ": " + advice;
}

retarget::AccuracyReport told(const ChosenStep& chosen) {
  retarget::AccuracyReport report = chosen.report;
  report.method = physics::name_of(chosen.setting.method);
  report.dt_s = chosen.setting.dt_s;
  return report;
}

void write_curve(io::CreatureWriter& writer, const io::AccuracyCurve& curve) {
  writer.write("accuracy.csv", io::accuracy_csv(curve));
  writer.write("accuracy.svg", io::accuracy_svg(curve));
}

std::string saved_words(const retarget::RunReport& run) {
  const retarget::AccuracyReport& report = run.accuracy;
  if (report.finest_ms_per_sim_s == 0) return {};
  char text[320];
  std::snprintf(text, sizeof text,
                "accuracy: %.3g %% of L over %.3g s on %d nodes by '%s' in steps of %.3g s, %.3g ms of the processor for a simulated "
                "second; the most accurate that was tried takes %.3g ms\n",
                100 * report.estimated_error_length, report.estimated_span_s, run.body.nodes, report.method.c_str(), report.dt_s, report.ms_per_sim_s,
                report.finest_ms_per_sim_s);
  return text;
}

std::string too_inaccurate(const std::string& where, const retarget::AccuracyReport& report) {
  char text[240];
  if (!std::isfinite(report.estimated_error_length)) {
    std::snprintf(text, sizeof text, "no setting that was tried stays within %.3g %% of L and breaks, or stays up, as in finer steps",
                  100 * report.max_error_length);
    return one_line({where, "accuracy", text, "Ask for a larger --max-error or let --method be auto"});
  }
  std::snprintf(text, sizeof text,
                "no setting that was tried stays within %.3g %% of L; '%s' with steps of %.3g s, the nearest, has %.3g %%",
                100 * report.max_error_length, report.method.c_str(), report.dt_s, 100 * report.estimated_error_length);
  return one_line({where, "accuracy", text, "Ask for a larger --max-error or let --method be auto"});
}

std::string refuse_empty(const std::string& text) { return text.empty() ? "is empty" : ""; }

void add_accuracy_options(CLI::App& app, AskedAccuracy& asked) {
  CLI::Option* most = app.add_option(
      "--max-error", asked.max_error,
      "1% or 0.01 of L: the cheapest method and step are taken that stay within it, as measured on this body; by convert the cheapest "
      "number of harmonics and, without --nodes, control mesh too");
  most->check(refuse_empty);
  app.add_option("--accuracy", asked.grade, "draft, standard or final: --max-error 5%, 1% or 0.1%")
      ->check(CLI::IsMember({"draft", "standard", "final"}))
      ->excludes(most);
}

}  // namespace hydrostat::cli

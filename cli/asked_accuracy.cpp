#include "cli/asked_accuracy.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "cli/command_line.h"
#include "cli/number_option.h"
#include "retarget/performed_scenario.h"

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

/// The first of the candidates from the present one on whose closed loop stays near the finest one's, and up; the finest at
/// the latest.
void take_candidate(ChosenStep& chosen, const retarget::Performer& performer, const retarget::SignalSet& signals) {
  const double floor_m = chosen.reference->uncertainty_m();
  const double most_m = chosen.report.max_error_length * performer.length - floor_m;
  const std::vector<retarget::AccuracyRow>& rows = chosen.curve.rows;
  for (;; ++chosen.candidate) {
    chosen.curve.recommended = chosen.candidates[chosen.candidate];
    const retarget::AccuracyRow& row = rows[static_cast<std::size_t>(chosen.curve.recommended)];
    chosen.setting = {*physics::method_named(row.method), row.dt_s};
    double error_m = row.error_rms_m;
    const bool is_last = chosen.candidate + 1 == chosen.candidates.size();
    if (!is_last) error_m = std::max(error_m, closed_loop_error(*chosen.finest, performer, performer, signals, chosen.setting));
    chosen.report.estimated_error_length = (error_m + floor_m) / performer.length;
    tell_saved(rows, chosen.curve.recommended, chosen.candidates.back(), chosen.report);
    if (is_last || error_m <= most_m) return;
  }
}

}  // namespace

double AskedAccuracy::most(const std::string& command) const {
  return grade.empty() ? parse_share(max_error, command, "--max-error") : kGrades.at(grade);
}

template <int Dim>
ChosenStep choose_step(const AskedAccuracy& asked, const std::string& command, const retarget::ReferenceOf<Dim>& reference,
                       std::optional<physics::Method> only) {
  const double length = reference.scenario.length, floor = reference.uncertainty_m() / length;
  double most = asked.most(command);
  if (asked.grade.empty() && most <= floor) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "the reference itself is only known within %.2g %% of L, so that %.2g %% cannot be told", 100 * floor,
                  100 * most);
    throw UsageError(command, "option --max-error", text, "Ask for a larger error.");
  }
  if (!asked.grade.empty()) most = std::max(most, kOverFloor * floor);
  const retarget::StepChoice choice = retarget::choose_setting(reference, most * length, only);
  ChosenStep chosen;
  chosen.setting = choice.setting;
  chosen.report.max_error_length = most;
  chosen.report.estimated_error_length = choice.estimated_error_m / length;
  chosen.curve.subject = "this body";
  chosen.curve.truth = "Errors are distances to '" + physics::name_of(reference.setting.method) + "' in much shorter steps.";
  chosen.curve.rows = choice.tried;
  chosen.curve.recommended =
      choice.is_met ? retarget::cheapest_within(choice.tried, most * length - reference.uncertainty_m()) : -1;
  chosen.curve.max_error = most;
  chosen.curve.floor = floor;
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
  if (!chosen.report.is_met()) return chosen;
  const retarget::StepSetting finest{only.value_or(reference.setting.method), is_rough ? kRoughFinestSeconds : kFinestSeconds};
  chosen.finest = closed_loop(performer, signals, finest);
  std::vector<retarget::AccuracyRow>& rows = chosen.curve.rows;
  rows.push_back(retarget::measure_error(reference, reference.scenario, finest));
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
  ++chosen.candidate;
  chosen.harmonics = 0;
  take_candidate(chosen, performer, signals);
  return true;
}

template ChosenStep choose_step<2>(const AskedAccuracy&, const std::string&, const retarget::ReferenceOf<2>&,
                                   std::optional<physics::Method>);
template ChosenStep choose_step<3>(const AskedAccuracy&, const std::string&, const retarget::ReferenceOf<3>&,
                                   std::optional<physics::Method>);

void take_steps(retarget::ReplayOptions& options, const retarget::StepSetting& setting) {
  options.method = setting.method;
  options.steps_per_control = std::max(1, static_cast<int>(std::lround(kControlSeconds / setting.dt_s)));
  options.step_s = kControlSeconds / options.steps_per_control;
}

void cut_harmonics(ChosenStep& chosen, const retarget::Performer& performer, retarget::SignalSet& signals) {
  constexpr int kLeast = 4;
  const int all = signals.activation.harmonics();
  for (retarget::AccuracyRow& row : chosen.curve.rows) row.harmonics = all;
  if (!chosen.report.is_met() || !chosen.finest || chosen.report.max_error_length >= kRough) return;
  const double room = (chosen.report.max_error_length - chosen.curve.floor) * performer.length;
  int kept = all;
  for (const double part : {0.75, 0.5, 0.25}) {
    const int harmonics = std::max(kLeast, static_cast<int>(std::lround(part * all)));
    if (harmonics >= kept) break;
    retarget::AccuracyRow row = retarget::measure_error(
        *chosen.reference, retarget::performed_scenario(performer, signals, harmonics), chosen.setting);
    row.harmonics = harmonics;
    chosen.curve.rows.push_back(row);
    if (!row.stable || row.error_rms_m > room) break;
    const retarget::SignalSet fewer = retarget::with_harmonics(signals, harmonics);
    const double error_m = std::max(row.error_rms_m, closed_loop_error(*chosen.finest, performer, performer, fewer, chosen.setting));
    if (error_m > room) break;
    chosen.harmonics = kept = harmonics;
    chosen.curve.recommended = static_cast<int>(chosen.curve.rows.size()) - 1;
    chosen.report.estimated_error_length = error_m / performer.length + chosen.curve.floor;
  }
  if (kept < all) signals = retarget::with_harmonics(signals, kept);
}

bool take_coarser(ChosenStep& chosen, const retarget::Performer& solved, const retarget::Performer& coarser,
                  const retarget::SignalSet& signals) {
  retarget::AccuracyRow row = retarget::measure_level(*chosen.reference, coarser, signals, chosen.setting);
  row.harmonics = signals.activation.harmonics();
  const double loop_m = closed_loop_error(*chosen.finest, solved, coarser, signals, chosen.setting);
  row.falls = loop_m == HUGE_VAL;
  row.stable = row.stable && !row.falls;
  chosen.curve.rows.push_back(row);
  const double error_m = std::max(row.error_rms_m, loop_m);
  const double error = error_m / solved.length + chosen.curve.floor;
  const retarget::AccuracyRow& present = chosen.curve.rows[static_cast<std::size_t>(chosen.curve.recommended)];
  if (!row.stable || error > chosen.report.max_error_length || row.work_ms >= present.work_ms) return false;
  const int finest = chosen.candidates.back();
  chosen.curve.recommended = static_cast<int>(chosen.curve.rows.size()) - 1;
  chosen.report.estimated_error_length = error;
  tell_saved(chosen.curve.rows, chosen.curve.recommended, finest, chosen.report);
  return true;
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
  char text[280];
  std::snprintf(text, sizeof text,
                "accuracy: %.3g %% of L on %d nodes by '%s' in steps of %.3g s, %.3g ms of the processor for a simulated second; the most "
                "accurate that was tried takes %.3g ms\n",
                100 * report.estimated_error_length, run.body.nodes, report.method.c_str(), report.dt_s, report.ms_per_sim_s,
                report.finest_ms_per_sim_s);
  return text;
}

std::string too_inaccurate(const std::string& where, const retarget::AccuracyReport& report) {
  char text[240];
  std::snprintf(text, sizeof text,
                "no setting that was tried stays within %.3g %% of L; '%s' with steps of %.3g s, the nearest, has %.3g %%",
                100 * report.max_error_length, report.method.c_str(), report.dt_s, 100 * report.estimated_error_length);
  return one_line({where, "accuracy", text, "Ask for a larger --max-error or let --method be auto"});
}

void add_accuracy_options(CLI::App& app, AskedAccuracy& asked) {
  CLI::Option* most = app.add_option(
      "--max-error", asked.max_error,
      "1% or 0.01 of L: the cheapest method and step are taken that stay within it, as measured on this body; by convert the cheapest "
      "number of harmonics and, without --nodes, control mesh too");
  app.add_option("--accuracy", asked.grade, "draft, standard or final: --max-error 5%, 1% or 0.1%")
      ->check(CLI::IsMember({"draft", "standard", "final"}))
      ->excludes(most);
}

}  // namespace hydrostat::cli

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "io/accuracy_page.h"
#include "io/creature_directory.h"
#include "retarget/performance.h"
#include "retarget/setting_choice.h"

namespace hydrostat::cli {

/// What --max-error and --accuracy ask for.
struct AskedAccuracy {
  std::string max_error, grade;  // "1%"; "draft", "standard" or "final"; empty: nothing was asked for

  bool is_asked() const { return !max_error.empty() || !grade.empty(); }
  /// [per L]
  double most(const std::string& command) const;
};

/// The setting that an accuracy asks for, and what the report tells of it.
struct ChosenStep {
  retarget::StepSetting setting;
  retarget::AccuracyReport report;
  io::AccuracyCurve curve;                            // of what was tried, the chosen one marked
  std::optional<retarget::ReferenceOf<3>> reference;  // of a creature
  std::optional<retarget::Replay> finest;             // likewise: its closed loop in steps finer than any choice
  std::vector<int> candidates;                        // rows within the error, least work first, the finest at the end
  std::size_t candidate = 0;                          // that is chosen
  int harmonics = 0;                                  // that signals were cut to; 0: they are whole
  int wished_nodes = 0;                               // of the control mesh; 0: the creature's own
  std::vector<std::string> warnings;                  // of what fell
};
/// A creature's steps are whole parts of it.
constexpr double kControlSeconds = 1.0 / 120;
/// Throws UsageError, in the name of a command, for an error below what the reference can show; a grade is then as near as
/// that. `duration_s`: of the run that the error is asked for, where it lasts longer than the reference and nothing touches.
template <int Dim>
ChosenStep choose_step(const AskedAccuracy& asked, const std::string& command, const retarget::ReferenceOf<Dim>& reference,
                       std::optional<physics::Method> only, double duration_s = 0);

/// Of a creature: what keeps its open loop near in short windows that start from its target, and then its closed loop, which
/// has to stay up where the finest does.
ChosenStep choose_step(const AskedAccuracy& asked, const std::string& command, const retarget::Performer& performer,
                       const retarget::SignalSet& signals, std::optional<physics::Method> only);

/// Whether a whole replay, which lasts longer than what choices are held against, leaves its path by more than the error that was
/// asked for beyond what the finest setting does.
bool strays(const ChosenStep& chosen, const retarget::Replay& run);

/// Takes the next candidate, for what was chosen fell or strayed in the end, and says so in a warning more; false where there is none.
/// `signals` are whole again.
bool take_next(ChosenStep& chosen, const retarget::Performer& performer, const retarget::SignalSet& signals);

/// Steps of a replay, whose control takes kControlSeconds.
void take_steps(retarget::ReplayOptions& options, const retarget::StepSetting& setting);
/// What a report tells of an accuracy, with what was chosen.
retarget::AccuracyReport told(const ChosenStep& chosen);

/// accuracy.csv and accuracy.svg of what was tried.
void write_curve(io::CreatureWriter& writer, const io::AccuracyCurve& curve);

/// Cuts a creature's signals to as few harmonics as leave both loops within the error that was asked for; the rows that were
/// tried join the curve.
void cut_harmonics(ChosenStep& chosen, const retarget::Performer& performer, retarget::SignalSet& signals);

/// Whether the creature, solved on a coarser control mesh and by signals of as many harmonics, does less work than what is chosen
/// and yet keeps its skin within the error, in both loops. Then it is chosen; it joins the curve in any case.
bool take_coarser(ChosenStep& chosen, const retarget::Performer& solved, const retarget::Performer& coarser,
                  const retarget::SignalSet& signals);

/// The line that tells what a choice costs and saves; empty where nothing was chosen.
std::string saved_words(const retarget::RunReport& run);

/// The warning of a setting by which a body breaks otherwise than by `finer`.
std::string breaks_otherwise(const retarget::StepSetting& setting, const retarget::Breaking& breaking, const retarget::StepSetting& finer,
                             const retarget::Breaking& finer_breaking);

/// The line that tells of an error above what was asked for.
std::string too_inaccurate(const std::string& where, const retarget::AccuracyReport& report);

/// Complains of an option that is told and yet empty.
std::string refuse_empty(const std::string& text);

/// Adds both options; they exclude each other.
void add_accuracy_options(CLI::App& app, AskedAccuracy& asked);

}  // namespace hydrostat::cli

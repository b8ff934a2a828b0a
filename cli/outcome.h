#pragma once

#include <string>
#include <vector>

#include "cli/progress.h"
#include "io/accuracy_page.h"
#include "io/appearance.h"
#include "io/creature_directory.h"
#include "io/exports.h"
#include "retarget/performance.h"

namespace hydrostat::cli {

/// Whether the run fell or diverged.
bool is_down(const retarget::Replay& replay);

/// What to give 'convert' where the run is down, after a verb: a higher --limit only where a telling share of the constraints was at theirs.
std::string change_of_conversion(const retarget::Replay& replay);

/// Puts the replays' figures into the report.
void report_replays(const retarget::Performances& performances, retarget::RunReport& report);

/// Writes replay.glb with its exports, or failed.glb where the outcome is short of what was asked, and takes the others away, for
/// no export may show another motion than replay.glb; report.json and report.html; accuracy.csv and accuracy.svg of a curve.
void write_outcome(io::CreatureWriter& writer, const retarget::Performer& performer, const io::Appearance& appearance,
                   const retarget::SignalSet& signals, const retarget::Performances& performances, const retarget::RunReport& report,
                   const io::AccuracyCurve* curve, const io::Exports& exports);

/// What the report warns of, to be seen without opening it: a line each, but for what begins with `told_elsewhere`.
void note_warnings(Progress& progress, const std::vector<std::string>& warnings, const std::string& told_elsewhere = "");

/// The figures of a signal set; its error against the activations is not known here.
retarget::SignalsReport signals_report(const retarget::SignalSet& signals);

/// Fills effects and accuracy by measuring, and tells how the body differs from its plan.
void measure(const retarget::Performer& performer, const retarget::SignalSet& signals, const retarget::PerformOptions& options,
             retarget::RunReport& report);

/// Last words of a command. Standard output gets one line of figures, or the report as JSON; standard error, where the run is down,
/// one line with the cause and with `way_up`, what to do then, where that is known. Returns the exit code.
int tell_run(const retarget::Replay& run, const std::string& where, const std::string& motion_file, const std::string& way_up = "");
int tell_report(const retarget::Replay& run, const std::string& where, const std::string& motion_file,
                const retarget::RunReport& report, const std::string& way_up = "");

}  // namespace hydrostat::cli

#pragma once

#include <string>

#include "io/creature_directory.h"
#include "retarget/performance.h"

namespace hydrostat::cli {

/// The run that the user asked for: the closed loop where there is one, else the open loop.
const retarget::Replay& main_run(const retarget::Performances& performances);

/// Whether the run fell or diverged.
bool is_down(const retarget::Replay& replay);

/// Puts the replays' figures into the report.
void report_replays(const retarget::Performances& performances, retarget::RunReport& report);

/// Writes replay.glb, or failed.glb where the run is down, and takes the other one away; report.json and report.html.
void write_outcome(io::CreatureWriter& writer, const retarget::Performer& performer, const retarget::SignalSet& signals,
                   const retarget::Performances& performances, const retarget::RunReport& report);

/// The figures of a signal set; its error against the activations is not known here.
retarget::SignalsReport signals_report(const retarget::SignalSet& signals);

/// Fills effects and accuracy by measuring, and tells how the body differs from its plan.
void measure(const retarget::Performer& performer, const retarget::SignalSet& signals, const retarget::PerformOptions& options,
             retarget::RunReport& report);

/// One line: how long the creature stays up, and how near to target and clip.
std::string summary(const retarget::ReplayReport& report, const std::string& where);

/// One line: what went wrong with a run that is down.
std::string failure(const retarget::Replay& replay, const std::string& where, const std::string& motion_file);

/// Last words of a command: the report or the summary on standard output, a failure on standard error. Returns the exit code.
int tell_outcome(const std::string& where, const retarget::Performances& performances, const retarget::RunReport& report, bool json);

}  // namespace hydrostat::cli

#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "io/page_data.h"
#include "retarget/skin_distance.h"

namespace hydrostat::io {

/// A figure of a report; nothing where the report has none.
using Figure = std::variant<std::monostate, bool, double, std::string>;

struct ComparedRun {
  std::string name;  // what tells it from the others: the last part of its directory, or the whole of what was given
  PageData page;
  std::vector<std::pair<std::string, Figure>> figures;  // of its report, the same names in the same order for every run
};

/// How far a run's skin is from the first run's.
struct RunDistance {
  std::string obstacle;           // why that cannot be told; empty where it can
  retarget::SkinDistance course;  // empty where it cannot
};

/// Runs side by side; the others are held against the first.
struct Comparison {
  std::vector<ComparedRun> runs;
  std::vector<RunDistance> distances;  // of the second run, the third, ...
  double length_m = 1;                 // L of the first
};

/// Reads the report pages of creatures, of scenes' directories, or as they are named. Skins are compared where they have the
/// same vertices and triangles and their clips the same name. Throws Error where a page cannot be read.
Comparison compare_runs(const std::vector<std::string>& subjects);

/// Over the time that was compared: RMS of `distance` [m] (one of the courses), and the frame in which it is greatest.
struct DistanceSummary {
  double rms_m = 0, most_m = 0, most_time_s = 0;
};
DistanceSummary summary_of(const Eigen::VectorXd& distance, const Eigen::VectorXd& time_s);

/// Schema hydrostat.comparison/1 (README, "compare --json").
std::string comparison_json(const Comparison& comparison);

/// Writes one self-contained page: all motions in one view with one clock, figures and differences, and curves of the
/// distance between the skins and of what the reports' own diagrams show of each run. Throws Error when the file cannot be
/// written.
void write_comparison_page(const std::filesystem::path& path, const Comparison& comparison);

}  // namespace hydrostat::io

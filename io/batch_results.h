#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace hydrostat::io {

/// How one job of a batch ended.
struct BatchResult {
  std::string name, clip, out;
  std::string state;  // "done", "refused", "usage", "short of target", "crashed": the exit code in words
  int exit_code = 0;  // of 'hydrostat convert'; 128 + signal when one ended it
  double seconds = 0;
  std::string message;                    // the last line of the log where the job failed
  std::string settings;                   // fingerprint of program, clip and options
  std::string report_sha256;              // of report.json as the job left it; empty when there is none
  std::map<std::string, double> figures;  // of the closed loop, by their names in report.json
  std::vector<std::string> warnings;      // those of report.json
};

/// The figures that the results table shows, in the order of its columns.
const std::vector<std::string>& batch_figures();

/// Those of them that DIR/report.json holds as numbers; none when there is no report.
std::map<std::string, double> read_batch_figures(const std::filesystem::path& creature);

/// The warnings in DIR/report.json; none when there is no report.
std::vector<std::string> read_batch_warnings(const std::filesystem::path& creature);

/// A table with a header, one line a job, texts quoted as RFC 4180 asks; of warnings it has the number.
std::string batch_results_csv(const std::vector<BatchResult>& results);

/// Schema "hydrostat.batch/1": {schema, jobs, failed, results}.
std::string batch_results_json(const std::vector<BatchResult>& results);

/// Results of an earlier run; none when the file is missing. Throws Error when it is not what batch_results_json writes.
std::vector<BatchResult> read_batch_results(const std::filesystem::path& file);

}  // namespace hydrostat::io

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hydrostat::io {

/// One conversion of a batch.
struct BatchJob {
  std::string name;                  // for the table and the log; the name of `out` unless given
  std::filesystem::path clip, out;   // absolute
  std::vector<std::string> options;  // of 'hydrostat convert', as a shell would hand them over: "--limit", "0.1"
  int line = 0;                      // in the manifest
};

/// Reads MANIFEST.toml: [[job]] tables with `clip` and `out` (relative to the manifest), perhaps `name`, and options of
/// 'hydrostat convert' as `key = value` (`_` stands for `-`, true for a flag, a list for an option given several times, and
/// `clip_name` for --clip); [defaults] holds options for all jobs, which a job overrides.
/// Throws Error with the line when it is missing, is not TOML, has no job, a key of another kind, or the same `out` twice.
std::vector<BatchJob> read_batch_manifest(const std::filesystem::path& manifest);

}  // namespace hydrostat::io

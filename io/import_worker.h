#pragma once

#include <optional>
#include <string>

#include "io/read_limits.h"
#include "io/scene.h"
#include "retarget/error.h"

namespace hydrostat::io {

/// First call of every main() whose program imports: when this process was started as the worker of another, reads the file
/// that it was told to and returns the exit code; otherwise nothing.
std::optional<int> run_import_worker(int argc, char** argv);

/// The program that read_in_worker() starts, one whose main() calls run_import_worker(). Default: 'hydrostat-import' beside
/// the running program, or else the running program itself.
void set_import_worker_executable(const std::string& path);

/// What a reading cost.
struct ReadCost {
  double wall_s = 0, cpu_s = 0;  // start, reading and passing on
  double peak_mib = 0;           // of the reading process's resident memory [2^20 bytes], and at least of ours as it started
};

/// Reads a clip file in a process of its own, under limits of memory and time, which may read nothing else on the disk and
/// has no network (io/confine.h), so that a file which brings the reader down brings down nothing else. It ends with this
/// process at the latest; what it read comes through a pipe. Call it from a thread that outlives the reading. Throws Error:
/// the file is missing, refused, or ends the reader.
Scene read_in_worker(const std::string& path, const ReadLimits& limits = {}, ReadCost* cost = nullptr);

/// What is thrown where reading `path` takes longer than it may.
Error too_slow(const std::string& path, double time_s);

}  // namespace hydrostat::io

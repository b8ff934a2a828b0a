#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "io/scene.h"

namespace hydrostat::io {

/// First call of every main() whose program imports: when this process was started as the worker of another, reads the file
/// that it was told to and returns the exit code; otherwise nothing.
std::optional<int> run_import_worker(int argc, char** argv);

/// The program that read_in_worker() starts, one whose main() calls run_import_worker(). Default: the running program
/// itself.
void set_import_worker_executable(const std::string& path);

/// Reads a clip file in a process of its own, under a limit of memory (3 GiB; not under a sanitizer) and of time (20 s), so
/// that a file which brings the reader down brings down nothing else. Throws Error: the file is missing, refused, or ends
/// the reader.
Scene read_in_worker(const std::string& path, std::chrono::milliseconds time_limit = std::chrono::seconds(20));

}  // namespace hydrostat::io

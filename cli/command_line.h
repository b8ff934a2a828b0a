#pragma once

#include <iosfwd>
#include <memory>
#include <string>

#include "cli/subcommands.h"
#include "retarget/error.h"

namespace hydrostat::cli {

enum ExitCode { kDone = 0, kInputRefused = 1, kUsage = 2, kShortOfTarget = 3, kSomeJobsFailed = 4 };

/// The whole command line: every subcommand with its options. `exit_code` must outlive it.
std::shared_ptr<CLI::App> command_line(int& exit_code);

/// "file: where: what is wrong. How to mend." on one line; parts that the error leaves empty are left out.
std::string one_line(const Error& error);

/// Parses and runs `hydrostat <arguments>`: results go to standard output, one line for what is wrong to `errors`.
/// Returns the exit code; nothing is thrown.
int run(int argc, const char* const* argv, std::ostream& errors);

}  // namespace hydrostat::cli

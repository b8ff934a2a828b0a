#pragma once

#include "cli/subcommands.h"

namespace hydrostat::cli {

/// Adds 'bench import': what reading clips costs on this machine.
void add_bench_import(CLI::App& bench, int& exit_code);

}  // namespace hydrostat::cli

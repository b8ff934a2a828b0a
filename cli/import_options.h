#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cli/subcommands.h"
#include "io/import.h"

namespace hydrostat::cli {

/// Adds --mesh, --root, --up, --unit, --import-timeout and --import-memory to a subcommand that reads clips; they fill
/// `options`, which must outlive it.
void add_import_options(CLI::App& command, io::ImportOptions& options);

}  // namespace hydrostat::cli

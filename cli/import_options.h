#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/subcommands.h"
#include "io/import.h"

namespace hydrostat::cli {

/// Adds --mesh, --root, --up, --unit, --import-timeout and --import-memory to a subcommand that reads clips; they fill
/// `options`, which must outlive it.
void add_import_options(CLI::App& command, io::ImportOptions& options);

/// The clip files of a directory, by name. Throws Error where there is none or it cannot be read.
std::vector<std::filesystem::path> clip_files(const std::filesystem::path& directory);

}  // namespace hydrostat::cli

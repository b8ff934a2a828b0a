#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "io/exports.h"

namespace hydrostat::cli {

/// What --export and --export-rate were told.
struct AskedExport {
  std::vector<std::string> formats;
  double rate_hz = 0;  // not told
};

/// Adds both; `asked` has to outlive the parsing. `otherwise`: in the help, what holds where they are not given.
void add_export_options(CLI::App& app, AskedExport& asked, const std::string& otherwise);

/// The formats that are asked for in the place of those of `otherwise`, or these; the rate likewise. Throws UsageError for a
/// rate of nothing.
io::Exports exports_of(const AskedExport& asked, const io::Exports& otherwise, const std::string& command);

}  // namespace hydrostat::cli

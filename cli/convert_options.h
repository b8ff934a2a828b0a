#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "cli/asked_accuracy.h"
#include "cli/export_option.h"
#include "cli/import_options.h"
#include "retarget/creature.h"

namespace hydrostat::cli {

constexpr const char *kTet = "tet", *kHex = "hex";

/// What 'hydrostat convert' was told.
struct ConvertOptions {
  std::string clip_file, out, clip, root_motion = "auto", limit = "auto", method = "auto", element = kTet, material = "auto",
              wobble = "auto", polish = "auto", scene;
  double height = 0, firmness = retarget::CreatureOptions().firmness;
  int nodes = 0;
  double friction = retarget::CreatureOptions().friction;
  unsigned seed = 0;
  int threads = 1;
  bool calibrated = false, json = false, quiet = false;
  io::ImportOptions import;
  AskedAccuracy accuracy;
  AskedExport exports;
};

/// Adds them all; `options` has to outlive the parsing.
void add_convert_options(CLI::App& app, ConvertOptions& options);

/// Throw UsageError where options contradict each other.
retarget::CreatureOptions creature_options(const ConvertOptions& options);
/// Whether the signals are to be polished. What leaps again and again is only where that is asked for: polished, it keeps its feet on fewer
/// bodies that are not as planned.
bool wants_polish(const ConvertOptions& options, bool leaps_on);
io::Exports exports_of(const ConvertOptions& options);
/// Of |activation - 1|; 0: automatic.
double wished_limit(const ConvertOptions& options);

}  // namespace hydrostat::cli

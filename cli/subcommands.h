#pragma once

namespace CLI {
class App;
}

namespace hydrostat::cli {

// Each adds one subcommand to the program. What it finds is left in `exit_code` (0 done, 3 outcome short of the target, 4
// some jobs failed); Error and UsageError are for main() to tell.

/// `hydrostat info CLIP [--json]`: what the importer sees.
void add_info(CLI::App& app, int& exit_code);

/// `hydrostat signals DIR list|plot|set|gain|shift|filter|layers|reset`: activations, and the layers that edit them.
void add_signals(CLI::App& app, int& exit_code);

}  // namespace hydrostat::cli

#pragma once

namespace CLI {
class App;
}

namespace hydrostat::cli {

// Each adds its subcommand to `app`, in the file of its name; the subcommand runs while the command line is parsed. It
// reports through exceptions (Error: exit code 1, UsageError: 2) and sets `exit_code` for the outcomes that are none: 3
// and 4.

void add_info(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_simulate(CLI::App& app, int& exit_code);
void add_signals(CLI::App& app, int& exit_code);
void add_batch(CLI::App& app, int& exit_code);
void add_bench(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_explain(CLI::App& app, int& exit_code);

}  // namespace hydrostat::cli

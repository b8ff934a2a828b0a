#include "cli/bench.h"

#include <CLI/CLI.hpp>

#include "cli/bench_import.h"
#include "cli/subcommands.h"

namespace hydrostat::cli {

void add_bench(CLI::App& app, int& exit_code) {
  CLI::App* bench = app.add_subcommand("bench", "Measure what simulation costs on this machine, and what accuracy it buys");
  bench->require_subcommand(1);
  add_bench_accuracy(*bench, exit_code);
  add_bench_effects(*bench, exit_code);
  add_bench_scaling(*bench, exit_code);
  add_bench_speed(*bench, exit_code);
  add_bench_import(*bench, exit_code);
}

}  // namespace hydrostat::cli

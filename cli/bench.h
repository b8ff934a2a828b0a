#pragma once

#include <string>

namespace CLI {
class App;
}
namespace hydrostat::retarget {
struct EffectRow;
}

namespace hydrostat::cli {

// Each adds one measurement to 'hydrostat bench', in the file of its name.
void add_bench_accuracy(CLI::App& bench, int& exit_code);
void add_bench_effects(CLI::App& bench, int& exit_code);
void add_bench_scaling(CLI::App& bench, int& exit_code);
void add_bench_speed(CLI::App& bench, int& exit_code);

/// What 'bench effects' tells of one.
std::string effect_line(const retarget::EffectRow& row);

}  // namespace hydrostat::cli

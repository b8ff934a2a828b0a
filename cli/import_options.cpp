#include "cli/import_options.h"

#include <CLI/CLI.hpp>

#include "cli/number_option.h"

namespace hydrostat::cli {

void add_import_options(CLI::App& command, io::ImportOptions& options) {
  command.add_option("--mesh", options.meshes, "Mesh that comes along, by name or index; may be given several times [all]")
      ->take_all();
  command.add_option("--root", options.root,
                     "Of several skeletons the one that hangs on this node [the one that moves most]");
  command
      .add_option("--up", options.up, "The file's axis that points up: x, y, z, -x, -y or -z [the file's; for BVH a guess]")
      ->check(CLI::IsMember({"x", "y", "z", "-x", "-y", "-z"}));
  command.add_option("--unit", options.metres_per_unit, "Metres of the file's unit [the file's; for BVH a guess]")
      ->check(number_within(1e-6, 1e4));
  command.add_option("--import-timeout", options.limits.time_s, "Longest time to read a file [s]")
      ->check(number_within(0.1, 3600))
      ->capture_default_str();
  command.add_option("--import-memory", options.limits.memory_gib, "Most memory to read a file [GiB]")
      ->check(number_within(0.25, 1024))
      ->capture_default_str();
}

}  // namespace hydrostat::cli

#include "cli/import_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "cli/number_option.h"
#include "io/read_scene.h"
#include "retarget/error.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

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

std::vector<fs::path> clip_files(const fs::path& directory) {
  std::vector<fs::path> files;
  std::error_code failure;
  for (fs::directory_iterator entry(directory, failure), end; !failure && entry != end; entry.increment(failure)) {
    std::error_code ignored;
    if (entry->is_regular_file(ignored) && io::is_clip_file(entry->path().string())) files.push_back(entry->path());
  }
  if (failure)
    throw Error(directory.string(), "", "cannot be read (" + failure.message() + ")", "Make the directory readable");
  std::sort(files.begin(), files.end());
  if (files.empty())
    throw Error(directory.string(), "", "holds no clip file",
                "Give a file or a directory with .fbx, .glb, .gltf, .dae or .bvh files");
  return files;
}

}  // namespace hydrostat::cli

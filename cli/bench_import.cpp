#include "cli/bench_import.h"

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/command_line.h"
#include "cli/import_options.h"
#include "cli/place_option.h"
#include "io/import_worker.h"
#include "io/writable.h"
#include "io/write_file.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

constexpr int kTimes = 5;

struct ImportBench {
  std::vector<std::string> clips;
  std::string out;
  io::ImportOptions import;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Of several tries the one in which the machine was least busy with others.
io::ReadCost least_cost(const std::string& clip, const io::ReadLimits& limits) {
  io::ReadCost least;
  for (int i = 0; i < kTimes; ++i) {
    io::ReadCost cost;
    io::read_in_worker(clip, limits, &cost);
    if (i == 0 || cost.cpu_s < least.cpu_s) least = cost;
  }
  return least;
}

std::string row(const std::string& clip, const io::ImportOptions& options) {
  char text[300];
  try {
    const io::ReadCost reading = least_cost(clip, options.limits);
    const auto start = std::chrono::steady_clock::now();
    const retarget::Character character = io::import_character(clip, "", options);
    const double import_s = seconds_since(start);
    rusage own{};
    getrusage(RUSAGE_SELF, &own);
    std::snprintf(text, sizeof text, "%s,%ju,%.4f,%.4f,%.1f,%.4f,%.1f,%d,%d\n", fs::path(clip).filename().c_str(),
                  fs::file_size(clip), reading.wall_s, reading.cpu_s, reading.peak_mib, import_s,
                  static_cast<double>(own.ru_maxrss) / 1024, static_cast<int>(character.skin.vertices.cols()),
                  character.clip.frames());
  } catch (const Error& error) {
    std::snprintf(text, sizeof text, "%s,,,,,,,,\"%.150s\"\n", fs::path(clip).filename().c_str(), error.what());
  }
  return text;
}

int bench_import(const ImportBench& command) {
  io::refuse_unwritable(command.out);
  std::string table = "file,bytes,read_wall_s,read_cpu_s,read_peak_mib,import_s,own_peak_mib,vertices,frames\n";
  std::cout << table;
  std::vector<std::string> clips;
  for (const std::string& given : command.clips) {
    if (!fs::is_directory(given)) {
      clips.push_back(given);
      continue;
    }
    for (const fs::path& file : clip_files(given)) clips.push_back(file.string());
  }
  for (const std::string& clip : clips) {
    const std::string line = row(clip, command.import);
    std::cout << line << std::flush;
    table += line;
  }
  io::write_file(fs::path(command.out) / "import.csv", table);
  return kDone;
}

}  // namespace

void add_bench_import(CLI::App& bench, int& exit_code) {
  const auto command = std::make_shared<ImportBench>();
  CLI::App* sub = bench.add_subcommand("import", "Time and memory of reading clips");
  sub->add_option("CLIP", command->clips, "Clip files, or directories of such")->required();
  sub->add_option("-o,--out", command->out, "Directory for import.csv")->check(refuse_no_place)->required();
  add_import_options(*sub, command->import);
  sub->callback([command, &exit_code] { exit_code = bench_import(*command); });
}

}  // namespace hydrostat::cli

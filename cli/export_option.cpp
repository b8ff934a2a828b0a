#include "cli/export_option.h"

#include <algorithm>

#include "cli/number_option.h"
#include "retarget/error.h"

namespace hydrostat::cli {

void add_export_options(CLI::App& app, AskedExport& asked, const std::string& otherwise) {
  app.add_option(
         "--export", asked.formats,
         "What the motion is written as: glb (always), and beside it the point caches pc2 and mdd, or obj, a file a frame; "
         "may be given several times" +
             otherwise)
      ->check(CLI::IsMember({"glb", "pc2", "mdd", "obj"}))
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--export-rate", asked.rate_hz,
                 "Frames a second of pc2, mdd and obj" + (otherwise.empty() ? " [60]" : otherwise))
      ->check(number_within(io::kLeastExportRate, io::kMostExportRate));
}

io::Exports exports_of(const AskedExport& asked, const io::Exports& otherwise, const std::string& command) {
  io::Exports exports = otherwise;
  if (!asked.formats.empty()) {
    const auto is_asked = [&](const char* name) {
      return std::find(asked.formats.begin(), asked.formats.end(), name) != asked.formats.end();
    };
    exports.pc2 = is_asked("pc2");
    exports.mdd = is_asked("mdd");
    exports.obj = is_asked("obj");
  }
  if (asked.rate_hz > 0) exports.rate_hz = asked.rate_hz;
  if (asked.rate_hz > 0 && !exports.any()) {
    throw UsageError(command, "option --export-rate", "is a rate of pc2, mdd or obj, none of which is written",
                     "Give --export pc2, mdd or obj too, or leave it out.");
  }
  return exports;
}

}  // namespace hydrostat::cli

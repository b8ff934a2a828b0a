#pragma once

#include <filesystem>
#include <string>

#include "retarget/run_report.h"

namespace hydrostat::io {

/// The figures of a run as JSON text, schema hydrostat.report/1: the groups and names of RunReport's structs. A figure that
/// is not finite becomes null, and a warning names it. A replay that was not run is null, and so are time and cause of a
/// fall that did not happen. A scene's simulation has its group in the place of all that tells of a clip.
std::string report_json(const retarget::RunReport& report);

/// Writes report_json to a file. Throws Error when it cannot be written.
void write_report(const std::filesystem::path& path, const retarget::RunReport& report);

}  // namespace hydrostat::io

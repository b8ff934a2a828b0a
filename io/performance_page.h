#pragma once

#include <filesystem>

#include "io/report_page.h"
#include "retarget/performance.h"

namespace hydrostat::io {

/// Writes the report page of a creature's runs: the clip, the target and the replays in motion; the way of the COM, its height,
/// heading, drift, slip, correction, saturation, the mean activation of each bone region, the missing wrench, and the contacts
/// as planned and as they came; the curve of its accuracy (accuracy_svg) where there is one; `wobble` is worn by the main run. Throws Error when the file cannot
/// be written.
void write_performance_page(const std::filesystem::path& path, const retarget::Performer& performer,
                            const Appearance& appearance, const retarget::SignalSet& signals,
                            const retarget::Performances& performances, const retarget::RunReport& report,
                            const std::string& curve = "", const retarget::MovingMorphs& wobble = {});

}  // namespace hydrostat::io

#pragma once

#include <filesystem>

#include "io/scene_file.h"
#include "retarget/simulation.h"

namespace hydrostat::io {

/// Writes the motion of a scene's body as a binary glTF file. Throws Error when it cannot be written.
void write_simulation_glb(const std::filesystem::path& path, const SceneFile& scene, const retarget::Simulation& simulation);

/// Writes the report page of a scene: body, ground and obstacles in motion; energies, height and speed of the COM, contact, volume,
/// penetration, activation over time; the curve of its accuracy (accuracy_svg) where there is one. Throws Error when it cannot
/// be written.
void write_simulation_page(const std::filesystem::path& path, const SceneFile& scene, const retarget::Simulation& simulation,
                           const retarget::RunReport& report, const std::string& curve = "");

/// body.json of the scene's body.
std::string scene_body_text(const SceneFile& scene);

}  // namespace hydrostat::io

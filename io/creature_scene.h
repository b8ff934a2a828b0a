#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "retarget/performance.h"

namespace hydrostat::io {

/// What convert --scene leaves in a creature: its scene, standing alone.
constexpr const char* kCreatureSceneFile = "scene.toml";

/// Where a scene's places count from [m], in the coordinates of a creature's motion in any world: on the ground under its centre of mass
/// at its start.
Eigen::Vector3d scene_origin(const retarget::Performer& performer);

/// Puts a creature on its flat ground into the world of a scene file (README, "A creature's scene"): gravity, ground, obstacles, water,
/// air, pushes and effects; [body] and what is of it is refused. Places count from scene_origin. Returns what was mended of meshes. Throws
/// Error with the line for what is not told as it must be, for effects that contradict it, and for an obstacle that the creature would
/// start in.
std::vector<std::string> put_in_scene(const std::filesystem::path& file, retarget::Performer& performer);

/// Puts it into the scene of its own, where its directory has one.
void put_in_own_scene(const std::filesystem::path& creature, retarget::Performer& performer);

/// The text of DIR/scene.toml, schema "hydrostat.creature_scene/1": what a scene file tells, with the surfaces of its meshes in the
/// place of their files. Throws Error with the line for what is not told as it must be.
std::string creature_scene_text(const std::filesystem::path& file);

}  // namespace hydrostat::io

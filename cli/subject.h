#pragma once

#include <optional>
#include <string>

#include "io/load_creature.h"
#include "io/scene_file.h"

namespace hydrostat::cli {

/// What SCENE|DIR names: a scene file, the scene that a directory of 'simulate' came from, or a creature.
struct Subject {
  std::optional<io::SceneFile> scene;
  std::optional<io::LoadedCreature> creature;
};
Subject read_subject(const std::string& path);

}  // namespace hydrostat::cli

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "retarget/scenario.h"

namespace hydrostat::io {

/// A scene as its file tells it, meshed and ready to be simulated.
struct SceneFile {
  std::string file, sha256;
  std::variant<retarget::ScenarioOf<2>, retarget::ScenarioOf<3>> scenario;
  std::string shape;    // as the file calls the body's
  std::string element;  // "tet", "hex", "triangle" or "quad"
  std::string law;      // "springs", "stable_neo_hookean" or "corotated_linear"
  physics::Method method = physics::Method::kExplicit;
  bool method_is_auto = true;
  double dt_s = 1.0 / 240, duration_s = 2;
  double damping_time_s = 0;  // dashpot over spring
  unsigned seed = 0;
  std::vector<std::string> warnings;
};

/// Names that `method` may have in a scene, the first of them "auto".
std::vector<std::string> method_names();
/// "auto" is nothing.
std::optional<physics::Method> method_named(const std::string& name);

/// Reads SCENE.toml (README, "Scene files"); `seed`, `nodes`, the wished number, `element` and `duration_s` are taken for the file's own where given.
/// Files that it names lie relative to it. Throws Error with the line for what is not TOML, a key that is not known (with the nearest that is), a wrong type or range,
/// a surface that is not closed, a mesh with slivers, a region that holds nothing, activations that could reach 0.
SceneFile read_scene_file(const std::filesystem::path& file, std::optional<unsigned> seed = std::nullopt,
                          std::optional<int> nodes = std::nullopt, const std::string& element = "",
                          std::optional<double> duration_s = std::nullopt);

}  // namespace hydrostat::io

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace hydrostat::io {

/// What creature.toml tells: where the creature comes from, the settings it was made with, and which effects are on and why.
struct CreatureRecord {
  using Setting = std::variant<bool, std::int64_t, double, std::string>;
  struct Effect {
    std::string name, state, reason;  // state: "on" or "off"
  };
  std::string source_file;                                // as the user gave it, made absolute
  std::string source_sha256;                              // of its bytes
  std::string clip;                                       // name in the file
  double clip_rise_m = 0;                                 // of its centre of mass on this body, over its height at the start
  std::vector<std::pair<std::string, Setting>> settings;  // option without dashes in front -> value in use; order is kept
  std::vector<Effect> effects;
};

/// The text of creature.toml, schema "hydrostat.creature/1".
std::string to_toml(const CreatureRecord& record);

/// Reads DIR/creature.toml. Throws Error, with the line, when it is missing, is not TOML, lacks a key or has another schema.
CreatureRecord read_creature_record(const std::filesystem::path& creature);

}  // namespace hydrostat::io

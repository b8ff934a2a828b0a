#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/cli/run_program.h"

namespace hydrostat {

inline std::string in_quotes(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

/// `hydrostat convert <clip of samples/> -o <creature> <options>`, without progress.
inline Outcome convert(const std::filesystem::path& directory, const std::string& clip, const std::string& creature,
                       const std::string& options = "") {
  return hydrostat_in(directory, "convert " + in_quotes(std::filesystem::path(HYDROSTAT_SAMPLES) / clip) + " -o " + in_quotes(creature) +
                                     " --quiet " + options);
}

/// The trot on a body of few nodes: seconds instead of minutes, for laws that hold however well it goes.
constexpr const char* kSmallClip = "boxdog_trot.fbx";
constexpr const char* kSmallOptions = "--nodes 40 ";

inline nlohmann::json report_of(const std::filesystem::path& creature) {
  return nlohmann::json::parse(io::read_file(creature / "report.json"));
}

/// An effect as report.json tells it; empty where it does not.
inline nlohmann::json effect_of(const std::filesystem::path& creature, const std::string& name) {
  const nlohmann::json report = report_of(creature);
  for (const nlohmann::json& effect : report.at("effects")) {
    if (effect.at("name") == name) return effect;
  }
  return {};
}

/// replay.glb, or failed.glb where the creature fell.
inline std::string motion_bytes(const std::filesystem::path& creature) {
  const std::filesystem::path replay = creature / "replay.glb";
  return io::read_file(std::filesystem::exists(replay) ? replay : creature / "failed.glb");
}

inline std::set<std::string> names_in(const std::filesystem::path& directory) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) names.insert(entry.path().filename().string());
  return names;
}

}  // namespace hydrostat

#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "io/import.h"

// What tests of reading clips have in common.

namespace hydrostat::io::import_case {

using Box = std::array<double, 6>;  // min x y z, max x y z

inline const std::string kSamples = HYDROSTAT_SAMPLES;

/// Where clips lie that others made and that are not part of this project; empty when they are not there.
inline std::string assets() {
  const char* set = std::getenv("HYDROSTAT_ASSETS");
  const std::string directory = set ? set : HYDROSTAT_DEFAULT_ASSETS;
  return std::filesystem::exists(directory + "/golden_bbox.json") ? directory : std::string();
}

inline double extent(const Box& box) { return std::max({box[3] - box[0], box[4] - box[1], box[5] - box[2]}); }

/// Largest distance of a face from where it should be, relative to the box's largest extent.
inline double misfit(const BoxInfo& found, const Box& wanted) {
  double worst = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    worst = std::max({worst, std::abs(found.min[axis] - wanted[a]), std::abs(found.max[axis] - wanted[a + 3])});
  }
  return worst / extent(wanted);
}

inline Box box_of(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  return {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
}

/// What the command prints, both streams, and its exit code.
struct Outcome {
  std::string text;
  int exit_code;
};
inline Outcome run(const std::string& arguments) {
  FILE* pipe = popen((std::string(HYDROSTAT_BINARY) + " " + arguments + " 2>&1").c_str(), "r");
  std::string text;
  for (int letter = fgetc(pipe); letter != EOF; letter = fgetc(pipe)) text.push_back(static_cast<char>(letter));
  const int status = pclose(pipe);
  return {text, WIFEXITED(status) ? WEXITSTATUS(status) : -1};
}

}  // namespace hydrostat::io::import_case

#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "retarget/control_mesh.h"
#include "retarget/motion.h"

namespace hydrostat::io {

/// What a report page carries, read back.
struct PageData {
  std::filesystem::path file;
  nlohmann::ordered_json json;    // as the page's script takes it
  std::size_t replay = 0;         // which of its motions is the main run: the closed loop, else the open loop
  retarget::Motion nodes;         // of that run: the control nodes, at 60 Hz at most
  retarget::Embedding embedding;  // of the skin in them
  Eigen::Matrix3Xi triangles;     // of the skin
};

/// The report page of a directory that 'convert', 'replay' or 'simulate' wrote, or the file itself where a page is named.
/// Throws Error where there is none.
std::filesystem::path report_page_of(const std::filesystem::path& subject);

/// Reads a report page. Throws Error where it cannot be read, holds no run, or is damaged or of another version.
PageData read_page(const std::filesystem::path& file);

}  // namespace hydrostat::io

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/played_skin.h"

namespace hydrostat::io {

/// What a motion is written as beside its .glb file.
struct Exports {
  bool pc2 = false, mdd = false, obj = false;
  double rate_hz = 60;  // frames a second of these

  bool any() const { return pc2 || mdd || obj; }
  bool operator==(const Exports&) const = default;
};
constexpr double kLeastExportRate = 1, kMostExportRate = 240;  // [Hz]

/// "pc2,mdd,obj", as far as they are asked for; and back, without a rate: none for any other text.
std::string export_words(const Exports& exports);
std::optional<Exports> exports_named(const std::string& words);

/// All that exports of <stem>.glb may be called, beside it.
std::vector<std::string> export_names(const std::string& stem);

/// Writes beside `glb` what is asked for of the motion that it plays, in its world: <stem>.pc2 and <stem>.mdd with
/// <stem>.obj, the bind pose that they move, and <stem>.mtl; <stem>_obj/, with a file a frame. Vertices are those that
/// triangles draw. Throws Error where a file cannot be written.
void write_exports(const std::filesystem::path& glb, const EmbeddedSkin& skin, const retarget::ControlMesh& body,
                   const Eigen::Ref<const Eigen::VectorXd>& mass, const retarget::Motion& motion, const Exports& exports);

/// Before the work: throws Error where one of these cannot be written.
void refuse_exports(const std::filesystem::path& glb, const Exports& exports);

}  // namespace hydrostat::io

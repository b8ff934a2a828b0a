#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/clip_range.h"
#include "io/describe_clip.h"
#include "io/import.h"
#include "io/import_worker.h"
#include "io/read_chosen_parts.h"
#include "io/rig.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr double kSmallest = 0.01, kLargest = 30;    // [m]; what a creature's length lies between
constexpr double kUsualLeast = 0.1, kUsualMost = 5;  // [m]; where a guessed unit must bring it

nlohmann::ordered_json to_list(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

void warn_of_size(const ClipInfo& clip, double metres_per_unit, std::vector<std::string>& warnings) {
  const double length = (clip.bbox.front().max - clip.bbox.front().min).maxCoeff();
  if (length >= kSmallest && length <= kLargest) return;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "The character is %.3g m long, which is no creature's size; give its height (--height).", length);
  for (const double share : {0.01, 0.001, 100.0}) {
    if (length * share < kUsualLeast || length * share > kUsualMost) continue;
    std::snprintf(
        text.data(), text.size(),
        "The character is %.3g m long, which is no creature's size; if the file's unit were %.6g m it would be %.3g m "
        "(--unit %.6g), or give its height (--height).",
        length, metres_per_unit * share, length * share, metres_per_unit * share);
    break;
  }
  warnings.emplace_back(text.data());
}

/// Why the file's numbers are taken for metres, and an axis for the one that points up, as they are.
std::string unit_reason(const std::string& format, bool is_told) {
  if (is_told) return "as --unit says";
  if (format == "fbx") return "the file's UnitScaleFactor";
  if (format == "gltf") return "glTF's unit is the metre";
  return format == "bvh" ? "a guess, for BVH has no unit" : "the file's unit is in its nodes";
}
std::string up_reason(const std::string& format, bool is_told) {
  if (is_told) return "as --up says";
  if (format == "fbx") return "the file's UpAxis";
  if (format == "gltf") return "glTF's axis";
  return format == "bvh" ? "a guess, for BVH has no axes" : "the file's axis is in its nodes";
}

bool is_finite(const ClipInfo& clip) {
  bool finite = std::isfinite(clip.speed_m_s + clip.foot_speed_m_s + clip.closure_defect_length + clip.max_strain);
  for (const BoxInfo& box : clip.bbox) finite = finite && box.min.allFinite() && box.max.allFinite();
  return finite;
}

/// Refuses a file when its time is up.
class Deadline {
 public:
  Deadline(const std::string& path, const ReadLimits& limits) : path_(path), limits_(limits) {}
  void check() const {
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count() > limits_.time_s)
      throw too_slow(path_, limits_.time_s);
  }

 private:
  const std::string& path_;
  const ReadLimits limits_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

FileInfo inspect(const std::string& path, const ImportOptions& options) {
  const Deadline deadline(path, options.limits);
  const Scene scene = read_chosen_parts(path, options);
  const Rig rig = build_rig(scene, path);
  const std::size_t first_moving = choose_clip(scene, "", path);
  FileInfo info;
  info.file = path;
  info.format = scene.format;
  info.up = scene.up;
  info.metres_per_unit = scene.metres_per_unit;
  info.unit_reason = unit_reason(scene.format, options.metres_per_unit > 0);
  info.up_reason = up_reason(scene.format, !options.up.empty());
  for (std::size_t b = 0; b < rig.skeleton.names.size(); ++b) {
    const int parent = rig.skeleton.parents[b];
    info.bones.push_back({rig.skeleton.names[b], parent < 0 ? "" : rig.skeleton.names[static_cast<std::size_t>(parent)],
                          rig.skeleton.weighted[b]});
  }
  for (const SceneMesh& mesh : scene.meshes) {
    info.meshes.push_back({mesh.name,
                           static_cast<int>(mesh.vertices.cols()),
                           static_cast<int>(mesh.triangles.cols()),
                           !mesh.joints.empty(),
                           {}});
    for (const SceneMesh::Morph& morph : mesh.morphs) info.meshes.back().morphs.push_back(morph.name);
  }
  for (std::size_t c = 0; c < scene.clips.size(); ++c) {
    deadline.check();
    info.clips.push_back(describe_clip(rig, scene, c));
    if (!is_finite(info.clips.back()))
      throw Error(path, "clip '" + info.clips.back().name + "'", "its transforms overflow",
                  "Export it anew in a sane scale");
  }
  info.files_confined = scene.files_confined;
  info.network_confined = scene.network_confined;
  info.warnings = scene.warnings;
  info.warnings.insert(info.warnings.end(), rig.warnings.begin(), rig.warnings.end());
  warn_of_size(info.clips[first_moving], info.metres_per_unit, info.warnings);
  return info;
}

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const FileInfo& info) {
  Json json{{"schema", "hydrostat.info/1"}, {"file", info.file}, {"format", info.format}};
  json["metres_per_unit"] = info.metres_per_unit;
  json["unit_reason"] = info.unit_reason;
  json["up"] = info.up;
  json["up_reason"] = info.up_reason;
  for (const char* list : {"bones", "meshes", "clips"}) json[list] = Json::array();
  for (const BoneInfo& bone : info.bones) {
    json["bones"].push_back({{"name", bone.name},
                             {"parent", bone.parent.empty() ? Json(nullptr) : Json(bone.parent)},
                             {"weighted", bone.weighted}});
  }
  for (const MeshInfo& mesh : info.meshes) {
    json["meshes"].push_back({{"name", mesh.name},
                              {"vertices", mesh.vertices},
                              {"triangles", mesh.triangles},
                              {"skinned", mesh.skinned},
                              {"morph_targets", mesh.morphs}});
  }
  for (const ClipInfo& clip : info.clips) {
    Json boxes = Json::array();
    for (const BoxInfo& box : clip.bbox)
      boxes.push_back({{"fraction", box.fraction}, {"min", to_list(box.min)}, {"max", to_list(box.max)}});
    Json contacts = Json::array();
    for (const ContactInfo& contact : clip.contacts) {
      Json times = Json::array();
      for (const auto& [from_s, until_s] : contact.times_s) times.push_back({from_s, until_s});
      contacts.push_back({{"bone", contact.bone}, {"duty", contact.duty}, {"times_s", times}});
    }
    Json morphs = Json::array();
    for (const MorphInfo& morph : clip.morphs)
      morphs.push_back({{"mesh", morph.mesh}, {"name", morph.name}, {"min", morph.min}, {"max", morph.max}});
    json["clips"].push_back({{"index", clip.index},
                             {"name", clip.name},
                             {"duration_s", clip.duration_s},
                             {"range_s", clip.range_s},
                             {"rate_hz", clip.rate_hz},
                             {"loop", clip.loop},
                             {"in_place", clip.in_place},
                             {"speed_m_s", clip.speed_m_s},
                             {"foot_speed_m_s", clip.foot_speed_m_s},
                             {"closure_defect_length", clip.closure_defect_length},
                             {"max_strain", clip.max_strain},
                             {"contacts", contacts},
                             {"morph_targets", morphs},
                             {"bbox", boxes}});
  }
  json["warnings"] = info.warnings;
  json["confined"] = {{"files", info.files_confined}, {"network", info.network_confined}};
  return json;
}

// Foreign names need not be UTF-8.
std::string text_of(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace); }

}  // namespace

std::string to_json(const FileInfo& info) { return text_of(json_of(info)); }

std::string to_json(const std::vector<std::variant<FileInfo, Error>>& files) {
  Json json{{"schema", "hydrostat.info_table/1"}, {"files", Json::array()}};
  for (const auto& entry : files) {
    if (const auto* info = std::get_if<FileInfo>(&entry)) {
      json["files"].push_back(json_of(*info));
    } else {
      const Error& error = std::get<Error>(entry);
      json["files"].push_back({{"file", error.file}, {"where", error.where}, {"error", error.what()}, {"mend", error.mend}});
    }
  }
  return text_of(json);
}

}  // namespace hydrostat::io

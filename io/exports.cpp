#include "io/exports.h"

#include <array>
#include <cmath>
#include <sstream>

#include "io/gltf_out.h"
#include "io/obj_out.h"
#include "io/point_cache.h"
#include "io/writable.h"
#include "io/write_file.h"

namespace hydrostat::io {
namespace {

namespace fs = std::filesystem;

constexpr double kOnFrame = 1e-6;  // of the time between two frames

constexpr std::array<std::pair<const char*, bool Exports::*>, 3> kFormats{
    {{"pc2", &Exports::pc2}, {"mdd", &Exports::mdd}, {"obj", &Exports::obj}}};

fs::path beside(const fs::path& glb, const char* ending) { return glb.parent_path() / (glb.stem().string() + ending); }

}  // namespace

std::string export_words(const Exports& exports) {
  std::string words;
  for (const auto& [name, is_asked] : kFormats) {
    if (exports.*is_asked) words += (words.empty() ? "" : ",") + std::string(name);
  }
  return words;
}

std::optional<Exports> exports_named(const std::string& words) {
  Exports exports;
  std::istringstream stream(words);
  for (std::string word; std::getline(stream, word, ',');) {
    for (const auto& [name, is_asked] : kFormats) exports.*is_asked |= word == name;
  }
  if (!exports.any() || export_words(exports) != words) return std::nullopt;
  return exports;
}

std::vector<std::string> export_names(const std::string& stem) {
  return {stem + ".pc2", stem + ".mdd", stem + ".obj", stem + ".mtl", stem + "_obj"};
}

void write_exports(const fs::path& glb, const EmbeddedSkin& skin, const retarget::ControlMesh& body,
                   const Eigen::Ref<const Eigen::VectorXd>& mass, const retarget::Motion& motion, const Exports& exports) {
  if (!exports.any()) return;
  const PlayedSkin played(skin, body, mass, motion);
  const GltfOptions looks;
  const ObjSkin drawn(parts_of(skin), skin.appearance == nullptr ? std::vector<Material>() : skin.appearance->materials,
                      skin.vertices, looks.name, looks.colour);
  const auto time_of = [&](Eigen::Index f) { return static_cast<double>(f) / exports.rate_hz; };
  PointCourse course;
  course.points = drawn.vertices().size();
  course.frames = static_cast<Eigen::Index>(played.motion().duration_s() * exports.rate_hz + kOnFrame) + 1;
  course.rate_hz = exports.rate_hz;
  course.at = [&](Eigen::Index f) -> Eigen::Matrix3Xd {
    return played.at(time_of(f)).vertices(Eigen::all, drawn.vertices());
  };
  if (exports.pc2) write_pc2(beside(glb, ".pc2"), course);
  if (exports.mdd) write_mdd(beside(glb, ".mdd"), course);
  const std::string stem = glb.stem().string(), material_file = stem + ".mtl";
  if (exports.pc2 || exports.mdd) {
    write_file(beside(glb, ".mtl"), drawn.material_text());
    write_file(beside(glb, ".obj"), drawn.text(skin.vertices, Eigen::Quaterniond::Identity(), material_file));
  }
  if (!exports.obj) return;
  const auto text_at = [&](Eigen::Index f) {
    const PlayedSkin::Pose pose = played.at(time_of(f));
    return drawn.text(pose.vertices, pose.turn, material_file);
  };
  write_obj_frames(beside(glb, "_obj"), stem, course.frames, text_at, drawn.material_text());
}

void refuse_exports(const fs::path& glb, const Exports& exports) {
  if (exports.pc2) refuse_unwritable_file(beside(glb, ".pc2"));
  if (exports.mdd) refuse_unwritable_file(beside(glb, ".mdd"));
  if (exports.pc2 || exports.mdd) {
    for (const char* ending : {".obj", ".mtl"}) refuse_unwritable_file(beside(glb, ending));
  }
  if (exports.obj) refuse_obj_frames(beside(glb, "_obj"), glb.stem().string());
}

}  // namespace hydrostat::io

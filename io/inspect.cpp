#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/clip_range.h"
#include "io/import.h"
#include "io/import_worker.h"
#include "io/rig.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr std::array<double, 5> kFractions{0, 0.15, 0.4, 0.7, 1};
constexpr double kLoopDefect = 0.02, kInPlaceTravel = 0.05, kSlide = 0.1, kLow = 0.03;  // relative to L
constexpr int kSlideFrames = 30;
constexpr double kSmallest = 0.01, kLargest = 30;  // [m]; what a creature's length lies between

/// The skinned vertices [m], or the joints where there is no mesh, at a time of the clip.
Eigen::Matrix3Xd points_at(const Rig& rig, const Scene& scene, const SceneClip& clip, double time_s) {
  const std::vector<Eigen::Affine3d> pose = bone_poses(rig, scene, clip, time_s);
  if (rig.skin.vertices.cols() > 0) return skin_positions(rig.skeleton, rig.skin, pose);
  Eigen::Matrix3Xd joints(3, static_cast<Eigen::Index>(pose.size()));
  for (std::size_t b = 0; b < pose.size(); ++b) joints.col(static_cast<Eigen::Index>(b)) = pose[b].translation();
  return joints;
}

Eigen::Vector3d horizontal(const Eigen::Vector3d& vector) { return {vector.x(), 0, vector.z()}; }

/// How far the low points slide in all [m]: the mean horizontal step of the points within 3 % of L of the lowest, summed.
double slide_of_low_points(const std::vector<Eigen::Matrix3Xd>& frames, double length) {
  double floor = frames.front().row(1).minCoeff();
  for (const Eigen::Matrix3Xd& frame : frames) floor = std::min(floor, frame.row(1).minCoeff());
  Eigen::Vector3d slide = Eigen::Vector3d::Zero();
  for (std::size_t f = 1; f < frames.size(); ++f) {
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    int low = 0;
    for (Eigen::Index p = 0; p < frames[f].cols(); ++p) {
      if (std::max(frames[f](1, p), frames[f - 1](1, p)) > floor + kLow * length) continue;
      step += frames[f].col(p) - frames[f - 1].col(p);
      ++low;
    }
    if (low > 0) slide += horizontal(step) / low;
  }
  return slide.norm();
}

void describe_travel(const Rig& rig, const Scene& scene, const SceneClip& clip, const ClipRange& range, ClipInfo& info) {
  std::vector<Eigen::Matrix3Xd> frames;
  for (int f = 0; f <= kSlideFrames; ++f) {
    frames.push_back(points_at(rig, scene, clip, range.start_s + range.length_s() * f / kSlideFrames));
  }
  const Eigen::Matrix3Xd& first = frames.front();
  const double length = (first.rowwise().maxCoeff() - first.rowwise().minCoeff()).maxCoeff();
  const Eigen::Matrix3Xd shift = frames.back() - first;
  const Eigen::Vector3d travel = horizontal(shift.rowwise().mean());
  const double defect = std::sqrt((shift.colwise() - travel).colwise().squaredNorm().mean());
  info.loop = defect <= kLoopDefect * length;
  info.in_place =
      info.loop && travel.norm() < kInPlaceTravel * length && slide_of_low_points(frames, length) > kSlide * length;
  info.speed_m_s = travel.norm() / range.length_s();
}

ClipInfo describe_clip(const Rig& rig, const Scene& scene, std::size_t index) {
  const SceneClip& clip = scene.clips[index];
  const ClipRange range = range_of(clip);
  ClipInfo info;
  info.index = static_cast<int>(index);
  info.name = clip.name;
  info.duration_s = clip.duration_s > 0 ? clip.duration_s : range.end_s;
  info.range_s = range.length_s();
  info.rate_hz = range.key_rate_hz;
  if (info.range_s >= kShortestClip) describe_travel(rig, scene, clip, range, info);
  for (const double fraction : kFractions) {
    const Eigen::Matrix3Xd points = points_at(rig, scene, clip, fraction * info.duration_s);
    info.bbox.push_back({fraction, points.rowwise().minCoeff(), points.rowwise().maxCoeff()});
  }
  return info;
}

nlohmann::ordered_json to_list(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

void warn_of_size(const ClipInfo& clip, std::vector<std::string>& warnings) {
  const double length = (clip.bbox.front().max - clip.bbox.front().min).maxCoeff();
  if (length >= kSmallest && length <= kLargest) return;
  std::array<char, 32> metres{};
  std::snprintf(metres.data(), metres.size(), "%.3g", length);
  warnings.push_back(std::string("The character is ") + metres.data() +
                     " m long, which is no creature's size; give its height.");
}

}  // namespace

FileInfo inspect(const std::string& path) {
  const Scene scene = read_in_worker(path);
  const Rig rig = build_rig(scene, path);
  const std::size_t first_moving = choose_clip(scene, "", path);
  FileInfo info;
  info.file = path;
  info.format = scene.format;
  info.up = scene.up;
  info.metres_per_unit = scene.metres_per_unit;
  for (std::size_t b = 0; b < rig.skeleton.names.size(); ++b) {
    const int parent = rig.skeleton.parents[b];
    info.bones.push_back({rig.skeleton.names[b], parent < 0 ? "" : rig.skeleton.names[static_cast<std::size_t>(parent)],
                          rig.skeleton.weighted[b]});
  }
  for (const SceneMesh& mesh : scene.meshes) {
    info.meshes.push_back(
        {mesh.name, static_cast<int>(mesh.vertices.cols()), static_cast<int>(mesh.triangles.cols()), !mesh.joints.empty()});
  }
  for (std::size_t c = 0; c < scene.clips.size(); ++c) info.clips.push_back(describe_clip(rig, scene, c));
  info.warnings = scene.warnings;
  info.warnings.insert(info.warnings.end(), rig.warnings.begin(), rig.warnings.end());
  warn_of_size(info.clips[first_moving], info.warnings);
  return info;
}

std::string to_json(const FileInfo& info) {
  using Json = nlohmann::ordered_json;
  Json json{{"schema", "hydrostat.info/1"},
            {"file", info.file},
            {"format", info.format},
            {"metres_per_unit", info.metres_per_unit},
            {"up", info.up},
            {"bones", Json::array()},
            {"meshes", Json::array()},
            {"clips", Json::array()}};
  for (const BoneInfo& bone : info.bones) {
    json["bones"].push_back({{"name", bone.name},
                             {"parent", bone.parent.empty() ? Json(nullptr) : Json(bone.parent)},
                             {"weighted", bone.weighted}});
  }
  for (const MeshInfo& mesh : info.meshes) {
    json["meshes"].push_back(
        {{"name", mesh.name}, {"vertices", mesh.vertices}, {"triangles", mesh.triangles}, {"skinned", mesh.skinned}});
  }
  for (const ClipInfo& clip : info.clips) {
    Json boxes = Json::array();
    for (const BoxInfo& box : clip.bbox)
      boxes.push_back({{"fraction", box.fraction}, {"min", to_list(box.min)}, {"max", to_list(box.max)}});
    json["clips"].push_back({{"index", clip.index},
                             {"name", clip.name},
                             {"duration_s", clip.duration_s},
                             {"range_s", clip.range_s},
                             {"rate_hz", clip.rate_hz},
                             {"loop", clip.loop},
                             {"in_place", clip.in_place},
                             {"speed_m_s", clip.speed_m_s},
                             {"bbox", boxes}});
  }
  json["warnings"] = info.warnings;
  return json.dump(2, ' ', false, Json::error_handler_t::replace);  // foreign names need not be UTF-8
}

}  // namespace hydrostat::io

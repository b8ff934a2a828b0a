#include "io/describe_clip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "io/capsules.h"
#include "io/clip_range.h"
#include "retarget/contacts.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr std::array<double, 5> kFractions{0, 0.15, 0.4, 0.7, 1};
constexpr double kLoopDefect = 0.02, kInPlaceTravel = 0.05, kSlide = 0.1, kLow = 0.03, kContact = 0.01;  // relative to L
constexpr int kFrames = 30;
constexpr double kPercentile = 0.99;
constexpr double kShortestEdge = 0.01;  // of L: shorter ones are creases of the mesh

/// The skinned vertices [m], or the joints where there is no mesh, at a time of the clip.
Eigen::Matrix3Xd points_at(const Rig& rig, const Scene& scene, const SceneClip& clip, double time_s) {
  const std::vector<Eigen::Affine3d> pose = bone_poses(rig, scene, clip, time_s);
  if (rig.skin.vertices.cols() > 0) return skin_positions(rig.skeleton, rig.skin, pose, morph_weights(rig, clip, time_s));
  Eigen::Matrix3Xd joints(3, static_cast<Eigen::Index>(pose.size()));
  for (std::size_t b = 0; b < pose.size(); ++b) joints.col(static_cast<Eigen::Index>(b)) = pose[b].translation();
  return joints;
}

Eigen::Vector3d horizontal(const Eigen::Vector3d& vector) { return {vector.x(), 0, vector.z()}; }

double lowest_of(const std::vector<Eigen::Matrix3Xd>& frames) {
  double floor = frames.front().row(1).minCoeff();
  for (const Eigen::Matrix3Xd& frame : frames) floor = std::min(floor, frame.row(1).minCoeff());
  return floor;
}

/// The ground as a conversion takes it.
double ground_of(const std::vector<Eigen::Matrix3Xd>& frames) {
  retarget::Motion lowest;
  lowest.frames.setZero(3, static_cast<Eigen::Index>(frames.size()));
  for (std::size_t f = 0; f < frames.size(); ++f)
    lowest.frames(1, static_cast<Eigen::Index>(f)) = frames[f].row(1).minCoeff();
  return retarget::ground_height(lowest);
}

/// How far the low points slide in all [m]: the mean horizontal step of the points within 3 % of L of the lowest, summed.
double slide_of_low_points(const std::vector<Eigen::Matrix3Xd>& frames, double length) {
  const double floor = lowest_of(frames);
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

/// The bone that moves each point most.
std::vector<int> owners(const Rig& rig, Eigen::Index points) {
  std::vector<int> bones;
  for (Eigen::Index p = 0; p < points; ++p) bones.push_back(static_cast<int>(p));  // joints are bones
  for (std::size_t v = 0; v < rig.skin.skin_weights.size(); ++v) {
    const auto& influences = rig.skin.skin_weights[v];
    bones[v] = std::max_element(influences.begin(), influences.end(), [](const auto& a, const auto& b) {
                 return a.weight < b.weight;
               })->bone;
  }
  return bones;
}

std::vector<ContactInfo> contacts_of(const Rig& rig, const std::vector<Eigen::Matrix3Xd>& frames, double length,
                                     double range_s) {
  const double reach = ground_of(frames) + kContact * length;
  const std::vector<int> bone_of = owners(rig, frames.front().cols());
  const std::size_t count = rig.skeleton.names.size();
  std::vector<std::vector<bool>> on(frames.size(), std::vector<bool>(count, false));
  for (std::size_t f = 0; f < frames.size(); ++f) {
    for (Eigen::Index p = 0; p < frames[f].cols(); ++p) {
      if (frames[f](1, p) <= reach) on[f][static_cast<std::size_t>(bone_of[static_cast<std::size_t>(p)])] = true;
    }
  }
  std::vector<ContactInfo> contacts;
  const double step_s = range_s / kFrames;
  for (std::size_t b = 0; b < count; ++b) {
    ContactInfo contact;
    contact.bone = rig.skeleton.names[b];
    for (std::size_t f = 0; f < frames.size(); ++f) {
      const double time_s = static_cast<double>(f) * step_s;
      if (!on[f][b]) continue;
      if (f == 0 || !on[f - 1][b]) contact.times_s.emplace_back(time_s, time_s);
      contact.times_s.back().second = time_s;
    }
    for (const auto& [from_s, until_s] : contact.times_s) contact.duty += (until_s - from_s) / range_s;
    if (!contact.times_s.empty()) contacts.push_back(std::move(contact));
  }
  return contacts;
}

/// Lengths of the skin's edges, without those that are creases of the bind pose, relative to it.
class Edges {
 public:
  explicit Edges(const Rig& rig) : skin_(rig.skin) {
    if (skin_.triangles.cols() == 0) return;
    const double extent = (skin_.vertices.rowwise().maxCoeff() - skin_.vertices.rowwise().minCoeff()).maxCoeff();
    std::set<std::pair<int, int>> all;
    for (Eigen::Index t = 0; t < skin_.triangles.cols(); ++t) {
      for (int c = 0; c < 3; ++c) {
        const int a = skin_.triangles(c, t), b = skin_.triangles((c + 1) % 3, t);
        if ((skin_.vertices.col(a) - skin_.vertices.col(b)).norm() > kShortestEdge * extent)
          all.emplace(std::min(a, b), std::max(a, b));
      }
    }
    pairs_.assign(all.begin(), all.end());
  }

  std::vector<double> stretches(const Eigen::Matrix3Xd& points) const {
    std::vector<double> result;
    for (const auto& [a, b] : pairs_)
      result.push_back((points.col(a) - points.col(b)).norm() / (skin_.vertices.col(a) - skin_.vertices.col(b)).norm());
    return result;
  }

 private:
  const retarget::SkinnedMesh& skin_;
  std::vector<std::pair<int, int>> pairs_;
};

double percentile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The bind pose may be of another size than the clip: the median edge of the first key keeps its length.
double max_strain(const Rig& rig, const std::vector<Eigen::Matrix3Xd>& frames) {
  const Edges edges(rig);
  std::vector<double> stretches = edges.stretches(frames.front());
  if (stretches.empty()) return 0;
  const double scale = percentile(stretches, 0.5);
  if (!(scale > 0)) return 0;
  double most = 0;
  for (const Eigen::Matrix3Xd& frame : frames) {
    stretches = edges.stretches(frame);
    for (double& stretch : stretches) stretch = std::abs(stretch / scale - 1);
    most = std::max(most, percentile(std::move(stretches), kPercentile));
  }
  return most;
}

std::vector<Eigen::Matrix3Xd> frames_of(const Rig& rig, const Scene& scene, const SceneClip& clip, const ClipRange& range) {
  std::vector<Eigen::Matrix3Xd> frames;
  for (int f = 0; f <= kFrames; ++f)
    frames.push_back(points_at(rig, scene, clip, range.start_s + range.length_s() * f / kFrames));
  return frames;
}

/// A skeleton alone touches the ground with the body that a conversion gives it.
void describe_contacts(const Rig& rig, const Scene& scene, const SceneClip& clip, const ClipRange& range,
                       const std::vector<Eigen::Matrix3Xd>& frames, double length, ClipInfo& info) {
  if (rig.skin.vertices.cols() > 0) {
    info.contacts = contacts_of(rig, frames, length, range.length_s());
    return;
  }
  Rig body = rig;
  try {
    add_capsules(body, "");
  } catch (const Error&) {
    return;  // no bone has a length
  }
  info.contacts = contacts_of(body, frames_of(body, scene, clip, range), length, range.length_s());
}

std::vector<MorphInfo> morphs_of(const Scene& scene, const SceneClip& clip) {
  std::vector<MorphInfo> morphs;
  for (const MorphChannel& channel : clip.morphs) {
    const auto mesh = std::find_if(scene.meshes.begin(), scene.meshes.end(), [&](const SceneMesh& other) {
      return other.node == channel.node && static_cast<std::size_t>(channel.target) < other.morphs.size();
    });
    if (mesh == scene.meshes.end()) continue;  // left out
    morphs.push_back({mesh->name, mesh->morphs[static_cast<std::size_t>(channel.target)].name,
                      channel.weight.values.minCoeff(), channel.weight.values.maxCoeff()});
  }
  return morphs;
}

void describe_travel(const Rig& rig, const Scene& scene, const SceneClip& clip, const ClipRange& range, ClipInfo& info) {
  const std::vector<Eigen::Matrix3Xd> frames = frames_of(rig, scene, clip, range);
  const Eigen::Matrix3Xd& first = frames.front();
  const double length = (first.rowwise().maxCoeff() - first.rowwise().minCoeff()).maxCoeff();
  const Eigen::Matrix3Xd shift = frames.back() - first;
  const Eigen::Vector3d travel = horizontal(shift.rowwise().mean());
  const double defect = std::sqrt((shift.colwise() - travel).colwise().squaredNorm().mean());
  const double slide = slide_of_low_points(frames, length);
  info.loop = defect <= kLoopDefect * length;
  info.in_place = info.loop && travel.norm() < kInPlaceTravel * length && slide > kSlide * length;
  info.speed_m_s = travel.norm() / range.length_s();
  info.foot_speed_m_s = slide / range.length_s();
  info.closure_defect_length = length > 0 ? defect / length : 0;
  info.max_strain = max_strain(rig, frames);
  describe_contacts(rig, scene, clip, range, frames, length, info);
}

}  // namespace

ClipInfo describe_clip(const Rig& rig, const Scene& scene, std::size_t index) {
  const SceneClip& clip = scene.clips[index];
  const ClipRange range = range_of(clip);
  ClipInfo info;
  info.index = static_cast<int>(index);
  info.name = clip.name;
  info.duration_s = clip.duration_s > 0 ? clip.duration_s : range.end_s;
  info.range_s = range.length_s();
  info.rate_hz = range.key_rate_hz;
  info.morphs = morphs_of(scene, clip);
  if (info.range_s >= kShortestClip) describe_travel(rig, scene, clip, range, info);
  for (const double fraction : kFractions) {
    double time_s = fraction * info.duration_s;
    if (scene.format == "bvh" && range.length_s() > 0)  // which tells of its frames alone
      time_s = std::nearbyint(time_s * range.key_rate_hz) / range.key_rate_hz;
    const Eigen::Matrix3Xd points = points_at(rig, scene, clip, time_s);
    info.bbox.push_back({fraction, points.rowwise().minCoeff(), points.rowwise().maxCoeff()});
  }
  return info;
}

}  // namespace hydrostat::io

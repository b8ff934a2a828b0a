#include "io/describe_clip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "io/capsules.h"
#include "io/clip_range.h"
#include "retarget/contacts.h"
#include "retarget/error.h"
#include "retarget/gravity.h"

namespace hydrostat::io {
namespace {

constexpr std::array<double, 5> kFractions{0, 0.15, 0.4, 0.7, 1};
constexpr double kLoopDefect = 0.02, kInPlaceTravel = 0.05, kSlide = 0.1, kLow = 0.03;  // relative to L
constexpr int kFrames = 30;
constexpr double kContact = 0.01;    // of L: how high skin may be that is on the ground,
constexpr double kRest = 0.002;      // and skin that goes fast over it
constexpr double kFast = 0.5;        // of the RMS speed of what the bones move, and
constexpr double kLeastFast = 0.1;   // of sqrt(g L) at least
constexpr double kContactRate = 60;  // [Hz] at which contacts are looked for,
constexpr double kMostPoints = 2e7;  // unless that were more points in all
constexpr int kFewestSteps = 60, kMostSteps = 5000;
constexpr double kShortestContact = 0.067;  // [s]; shorter ones and shorter gaps are none, but of very short clips
constexpr double kPercentile = 0.99;
constexpr double kShortestBond = 0.02, kLongestBond = 0.08;  // of the bind pose's extent
constexpr double kThinning = 0.03;                           // distance of the vertices that bonds join
constexpr std::size_t kMostInCell = 300;                     // of these vertices

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

/// How far the low points slide in all [m]: the mean horizontal step of the points within 3 % of L of the lowest, summed.
Eigen::Vector3d slide_of_low_points(const std::vector<Eigen::Matrix3Xd>& frames, double length) {
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
  return slide;
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

/// The lowest point of what each bone moves, over equal steps of a clip's time.
struct LowPoints {
  Eigen::MatrixXd height;  // [m] bones x times; infinite of a bone that moves nothing
  Eigen::MatrixXd speed;   // [m/s] horizontal, of that point against the ground, to the time before or after: the lesser
};

LowPoints low_points(const Rig& rig, const Scene& scene, const SceneClip& clip, const ClipRange& range, int steps,
                     const Eigen::Vector3d& ground_velocity) {
  const double step_s = range.length_s() / steps;
  const auto bones = static_cast<Eigen::Index>(rig.skeleton.names.size());
  LowPoints low;
  low.height.setConstant(bones, steps + 1, std::numeric_limits<double>::infinity());
  low.speed = low.height;
  std::vector<int> bone_of;
  Eigen::Matrix3Xd before;
  std::vector<Eigen::Index> lowest(rig.skeleton.names.size()), lowest_before;
  for (int f = 0; f <= steps; ++f) {
    const Eigen::Matrix3Xd now = points_at(rig, scene, clip, range.start_s + f * step_s);
    if (f == 0) bone_of = owners(rig, now.cols());
    for (Eigen::Index p = 0; p < now.cols(); ++p) {
      const int b = bone_of[static_cast<std::size_t>(p)];
      if (!(now(1, p) < low.height(b, f))) continue;
      low.height(b, f) = now(1, p);
      lowest[static_cast<std::size_t>(b)] = p;
    }
    for (Eigen::Index b = 0; f > 0 && b < bones; ++b) {
      if (!std::isfinite(low.height(b, f))) continue;
      const auto speed_of = [&](Eigen::Index p) {
        return horizontal((now.col(p) - before.col(p)) / step_s - ground_velocity).norm();
      };
      low.speed(b, f) = speed_of(lowest[static_cast<std::size_t>(b)]);
      low.speed(b, f - 1) = std::min(low.speed(b, f - 1), speed_of(lowest_before[static_cast<std::size_t>(b)]));
    }
    before = now;
    lowest_before = lowest;
  }
  return low;
}

/// The ground as a conversion takes it.
double ground_of(const LowPoints& low) {
  retarget::Motion lowest;
  lowest.frames.setZero(3, low.height.cols());
  lowest.frames.row(1) = low.height.colwise().minCoeff();
  return retarget::ground_height(lowest);
}

double rms_speed(const LowPoints& low) {
  double squared = 0;
  Eigen::Index count = 0;
  for (Eigen::Index b = 0; b < low.speed.rows(); ++b) {
    if (!std::isfinite(low.speed(b, 0))) continue;  // moves nothing
    squared += low.speed.row(b).squaredNorm();
    count += low.speed.cols();
  }
  return count == 0 ? 0 : std::sqrt(squared / static_cast<double>(count));
}

/// Runs of `what` shorter than `least`, between others, become as these.
void close_gaps(std::vector<bool>& on, bool what, std::size_t least) {
  for (std::size_t from = 0; from < on.size();) {
    std::size_t until = from;
    while (until < on.size() && on[until] == on[from]) ++until;
    if (on[from] == what && from > 0 && until < on.size() && until - from < least)
      std::fill(on.begin() + static_cast<std::ptrdiff_t>(from), on.begin() + static_cast<std::ptrdiff_t>(until), !what);
    from = until;
  }
}

std::vector<ContactInfo> contacts_of(const Rig& rig, const LowPoints& low, double length, double range_s) {
  const double ground = ground_of(low);
  const double fast = std::max(kFast * rms_speed(low), kLeastFast * std::sqrt(retarget::kGravity * length));
  const auto count = static_cast<std::size_t>(low.height.cols());
  const double step_s = range_s / static_cast<double>(count - 1);
  const auto least = std::min<std::size_t>(static_cast<std::size_t>(kShortestContact / step_s), count / 20);
  std::vector<ContactInfo> contacts;
  for (Eigen::Index b = 0; b < low.height.rows(); ++b) {
    std::vector<bool> on;
    for (Eigen::Index f = 0; f < low.height.cols(); ++f) {
      const double reach = low.speed(b, f) <= fast ? kContact : kRest;
      on.push_back(low.height(b, f) <= ground + reach * length);
    }
    close_gaps(on, false, least);
    close_gaps(on, true, least);
    ContactInfo contact;
    contact.bone = rig.skeleton.names[static_cast<std::size_t>(b)];
    // Each time that was looked at stands for half a step before and after it.
    for (std::size_t f = 0; f < count; ++f) {
      if (!on[f]) continue;
      const double from_s = std::max(0.0, (static_cast<double>(f) - 0.5) * step_s);
      if (f == 0 || !on[f - 1]) contact.times_s.emplace_back(from_s, from_s);
      contact.times_s.back().second = std::min(range_s, (static_cast<double>(f) + 0.5) * step_s);
    }
    for (const auto& [from_s, until_s] : contact.times_s) contact.duty += (until_s - from_s) / range_s;
    if (!contact.times_s.empty()) contacts.push_back(std::move(contact));
  }
  return contacts;
}

/// The bone above that moves skin, of each bone; -1: none.
std::vector<int> weighted_parents(const retarget::Skeleton& skeleton) {
  std::vector<int> parents(skeleton.names.size(), -1);
  for (std::size_t b = 0; b < parents.size(); ++b) {
    int above = skeleton.parents[b];
    while (above >= 0 && !skeleton.weighted[static_cast<std::size_t>(above)])
      above = skeleton.parents[static_cast<std::size_t>(above)];
    parents[b] = above;
  }
  return parents;
}

/// What would hold a soft body in this skin together: bonds between vertices that are near each other in the bind pose and
/// belong to one bone or to neighbours, whether triangles join them or not. So the segments of a spider hang together, and
/// two legs that stand side by side do not.
class Bonds {
 public:
  explicit Bonds(const Rig& rig) : skin_(rig.skin) {
    if (skin_.triangles.cols() == 0) return;
    const Eigen::Vector3d low = skin_.vertices.rowwise().minCoeff();
    const double extent = (skin_.vertices.rowwise().maxCoeff() - low).maxCoeff();
    if (!(extent > 0) || !std::isfinite(extent)) return;
    const std::vector<int> bone_of = owners(rig, skin_.vertices.cols()), parents = weighted_parents(rig.skeleton);
    const auto are_neighbours = [&](int a, int b) {
      return a == b || parents[static_cast<std::size_t>(a)] == b || parents[static_cast<std::size_t>(b)] == a;
    };
    // One vertex of a bone in each small cell; sought in large ones.
    std::set<std::array<int, 4>> taken;
    std::map<std::array<int, 3>, std::vector<int>> cells;
    const auto cell_of = [&](int v, double size) {
      const Eigen::Vector3i cell = ((skin_.vertices.col(v) - low) / (size * extent)).array().floor().cast<int>();
      return std::array{cell.x(), cell.y(), cell.z()};
    };
    for (int v = 0; v < static_cast<int>(skin_.vertices.cols()); ++v) {
      const int bone = bone_of[static_cast<std::size_t>(v)];
      const auto [x, y, z] = cell_of(v, kThinning);
      if (!taken.insert({x, y, z, bone}).second) continue;
      const std::array<int, 3> home = cell_of(v, kLongestBond);
      for (int n = 0; n < 27; ++n) {
        const auto near = cells.find({home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1});
        if (near == cells.end()) continue;
        for (const int other : near->second) {
          const double distance = (skin_.vertices.col(v) - skin_.vertices.col(other)).norm();
          if (distance >= kShortestBond * extent && distance <= kLongestBond * extent &&
              are_neighbours(bone, bone_of[static_cast<std::size_t>(other)]))
            pairs_.emplace_back(other, v);
        }
      }
      if (std::vector<int>& cell = cells[home]; cell.size() < kMostInCell) cell.push_back(v);
    }
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

/// The bind pose may be of another size than the clip: the median bond of the first key keeps its length.
double max_strain(const Rig& rig, const std::vector<Eigen::Matrix3Xd>& frames) {
  const Bonds bonds(rig);
  std::vector<double> stretches = bonds.stretches(frames.front());
  if (stretches.empty()) return 0;
  const double scale = percentile(stretches, 0.5);
  if (!(scale > 0)) return 0;
  double most = 0;
  for (const Eigen::Matrix3Xd& frame : frames) {
    stretches = bonds.stretches(frame);
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

/// The body that a conversion gives the rig: its own skin, or capsules along the bones of a skeleton alone.
std::optional<Rig> body_of(const Rig& rig) {
  Rig body = rig;
  try {
    if (rig.skin.vertices.cols() == 0) add_capsules(body, "");
  } catch (const Error&) {
    return std::nullopt;  // no bone has a length
  }
  return body;
}

int contact_steps(const Rig& body, const Scene& scene, double range_s) {
  const auto points = static_cast<double>(body.skin.vertices.cols());
  const auto nodes = static_cast<double>(scene.nodes.size() + body.skeleton.names.size());
  const double most = kMostPoints / std::max(1.0, points + 4 * nodes);
  return std::clamp(static_cast<int>(std::min(kContactRate * range_s, most)), kFewestSteps, kMostSteps);
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
  const Eigen::Vector3d slide = slide_of_low_points(frames, length);
  info.loop = defect <= kLoopDefect * length;
  info.in_place = info.loop && travel.norm() < kInPlaceTravel * length && slide.norm() > kSlide * length;
  info.speed_m_s = travel.norm() / range.length_s();
  info.foot_speed_m_s = slide.norm() / range.length_s();
  info.closure_defect_length = length > 0 ? defect / length : 0;
  const std::optional<Rig> body = body_of(rig);
  if (!body) return;
  const bool is_skin = rig.skin.vertices.cols() > 0;
  info.max_strain = max_strain(*body, is_skin ? frames : frames_of(*body, scene, clip, range));
  const Eigen::Vector3d ground_velocity =
      info.in_place ? Eigen::Vector3d(slide / range.length_s()) : Eigen::Vector3d::Zero();
  const int steps = contact_steps(*body, scene, range.length_s());
  info.contacts =
      contacts_of(*body, low_points(*body, scene, clip, range, steps, ground_velocity), length, range.length_s());
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

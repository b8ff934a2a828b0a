#include "io/lost_curves.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "io/scene_pose.h"

namespace hydrostat::io {
namespace {

constexpr double kSparse = 3.5;       // frames between neighbouring keys, above which they are no bake
constexpr double kSparseTurn = 8;     // [deg] between such keys
constexpr double kSparseScale = 0.1;  // change of scale between such keys [-]
constexpr double kDenseTurn = 24;     // [deg] between neighbouring keys of a bake
constexpr double kSeenMiss = 0.001;   // of the skeleton's extent, half way between such keys

/// The worst of a kind, and how many bones have it.
struct Worst {
  double amount = 0, span_s = 0;
  int bones = 0;
  std::string bone;
  void add(double more, double span, const std::string& name) {
    if (bone != name) ++bones;
    if (more > amount || bones == 1) amount = more, span_s = span, bone = name;
  }
};

double turn_deg(const Eigen::MatrixXd& quaternions, Eigen::Index k) {
  const double dot = std::min(1.0, std::abs(quaternions.col(k).dot(quaternions.col(k + 1))));
  return 2 * std::acos(dot) * 180 / std::numbers::pi;
}

using Angles = Eigen::Vector3d;  // about x, then y, then z, as FBX turns unless told otherwise

Eigen::Matrix3d turned(const Angles& angles) {
  return (Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// Of the angles that give a rotation those nearest to others.
Angles angles_near(const Eigen::Matrix3d& rotation, const Angles& others) {
  const Angles first(std::atan2(rotation(2, 1), rotation(2, 2)), std::asin(std::clamp(-rotation(2, 0), -1.0, 1.0)),
                     std::atan2(rotation(1, 0), rotation(0, 0)));
  const Angles second(first.x() + std::numbers::pi, std::numbers::pi - first.y(), first.z() + std::numbers::pi);
  const auto unwound = [&](const Angles& angles) {
    return Angles(angles - 2 * std::numbers::pi * ((angles - others).array() / (2 * std::numbers::pi)).round().matrix());
  };
  const Angles a = unwound(first), b = unwound(second);
  return (a - others).norm() <= (b - others).norm() ? a : b;
}

/// The angle [rad] half way between two keys from the great arc to what straight curves of Euler angles give: none where the
/// turn is about one of their axes.
double miss_of_arc(const Eigen::MatrixXd& quaternions, Eigen::Index k) {
  const Eigen::Quaterniond from(Eigen::Vector4d(quaternions.col(k))), to(Eigen::Vector4d(quaternions.col(k + 1)));
  const Angles start = angles_near(from.toRotationMatrix(), Angles::Zero()), end = angles_near(to.toRotationMatrix(), start);
  return Eigen::Quaterniond(turned(0.5 * (start + end))).angularDistance(from.slerp(0.5, to));
}

/// How far each node's turn reaches at rest: to the farthest joint below it [of the joints' largest extent].
std::vector<double> reaches(const Scene& scene) {
  const std::vector<Eigen::Affine3d> rest = node_poses(scene, nullptr, 0);
  std::vector<double> reach(rest.size(), 0.0);
  Eigen::AlignedBox3d box;
  for (std::size_t n = 0; n < rest.size(); ++n) {
    const Eigen::Vector3d place = rest[n].translation();
    if (!scene.nodes[n].is_joint) continue;
    box.extend(place);
    for (int up = static_cast<int>(n); up >= 0; up = scene.nodes[static_cast<std::size_t>(up)].parent) {
      double& farthest = reach[static_cast<std::size_t>(up)];
      farthest = std::max(farthest, (place - rest[static_cast<std::size_t>(up)].translation()).norm());
    }
    // A bone at the end of its limb carries skin as far, about, as the one above it.
    const int parent = scene.nodes[n].parent;
    if (parent >= 0) reach[n] = std::max(reach[n], (place - rest[static_cast<std::size_t>(parent)].translation()).norm());
  }
  const double extent = box.isEmpty() ? 0 : box.sizes().maxCoeff();
  for (double& each : reach) each = extent > 0 ? each / extent : 1;
  return reach;
}

std::string others(const Worst& worst) {
  if (worst.bones < 2) return "";
  return worst.bones == 2 ? " (and another bone)" : " (and " + std::to_string(worst.bones - 1) + " other bones)";
}

std::string number(const char* form, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), form, value);
  return text.data();
}

}  // namespace

std::vector<std::string> lost_curve_warnings(const Scene& scene, const SceneClip& clip, double frame_s) {
  Worst sparse, fast;
  const std::vector<double> reach = reaches(scene);
  // Angles that lie behind pivots are not known, and programs that write pivots curve their keys as well.
  const bool is_plain =
      std::all_of(scene.nodes.begin(), scene.nodes.end(), [](const SceneNode& node) { return node.parts.size() == 1; });
  for (const Channel& channel : clip.channels) {
    const std::string& name = scene.nodes[static_cast<std::size_t>(channel.node)].name;
    const auto spans = [&](const Track& track, auto&& look) {
      for (std::size_t k = 0; k + 1 < track.times.size(); ++k)
        look(static_cast<Eigen::Index>(k), track.times[k + 1] - track.times[k]);
    };
    spans(channel.rotation, [&](Eigen::Index k, double span_s) {
      const double turn = turn_deg(channel.rotation.values, k);
      if (span_s > kSparse * frame_s && turn > kSparseTurn) sparse.add(span_s, span_s, name);
      if (span_s > kSparse * frame_s || turn <= kDenseTurn) return;
      const double miss =
          !is_plain ? 1 : miss_of_arc(channel.rotation.values, k) * reach[static_cast<std::size_t>(channel.node)];
      if (miss > kSeenMiss) fast.add(turn, span_s, name);
    });
    spans(channel.scale, [&](Eigen::Index k, double span_s) {
      const double change = (channel.scale.values.col(k + 1) - channel.scale.values.col(k)).cwiseAbs().maxCoeff();
      const double size = channel.scale.values.col(k).cwiseAbs().maxCoeff();
      if (span_s > kSparse * frame_s && change > kSparseScale * size) sparse.add(span_s, span_s, name);
    });
  }
  std::vector<std::string> warnings;
  const std::string place = "Clip '" + clip.name + "', bone '";
  if (sparse.bones > 0) {
    warnings.push_back(
        place + sparse.bone + "'" + others(sparse) + ": keys are " + number("%.3g", sparse.span_s) +
        " s apart, and the Bezier curves that the file may have between them are read as straight turns; bake it to a key a "
        "frame before export.");
  }
  if (fast.bones > 0) {
    warnings.push_back(
        place + fast.bone + "'" + others(fast) + ": turns by " + number("%.0f", fast.amount) +
        " degrees between two keys, where the file's Euler curves may lie up to 1 % of the size beside the straight turn "
        "that is read; bake it at a higher rate before export.");
  }
  return warnings;
}

}  // namespace hydrostat::io

#include "io/lost_curves.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace hydrostat::io {
namespace {

constexpr double kSparse = 3.5;       // frames between neighbouring keys, above which they are no bake
constexpr double kSparseTurn = 8;     // [deg] between such keys
constexpr double kSparseScale = 0.1;  // change of scale between such keys [-]
constexpr double kDenseTurn = 24;     // [deg] between neighbouring keys of a bake

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
  for (const Channel& channel : clip.channels) {
    const std::string& name = scene.nodes[static_cast<std::size_t>(channel.node)].name;
    const auto spans = [&](const Track& track, auto&& look) {
      for (std::size_t k = 0; k + 1 < track.times.size(); ++k)
        look(static_cast<Eigen::Index>(k), track.times[k + 1] - track.times[k]);
    };
    spans(channel.rotation, [&](Eigen::Index k, double span_s) {
      const double turn = turn_deg(channel.rotation.values, k);
      if (span_s > kSparse * frame_s && turn > kSparseTurn) sparse.add(span_s, span_s, name);
      if (span_s <= kSparse * frame_s && turn > kDenseTurn) fast.add(turn, span_s, name);
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

#include "io/scene_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "io/clip_range.h"
#include "io/scene_pose.h"

namespace hydrostat::io {
namespace {

constexpr int kFramesLookedAt = 24;
constexpr double kSurer = 0.5;  // how much better the floor along z must be than along y
constexpr double kPerson = 1.7, kShortPerson = 1.4, kTallPerson = 2.0, kSmallest = 0.3, kLargest = 3;  // [m]
constexpr std::array<std::pair<double, const char*>, 4> kUnits{{{0.01, "centimetres"},
                                                                {0.0254, "inches"},
                                                                {0.0254 / 0.45, "units of the CMU library (inches / 0.45)"},
                                                                {0.001, "millimetres"}}};

/// The turn that takes an axis of the file to our y, by a right angle or two about one axis.
Eigen::Matrix3d turn_up(const std::string& up) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  const double sign = up.front() == '-' ? -1 : 1;
  switch (up.back()) {
    case 'x':
      turn(0, 1) = -sign, turn(1, 0) = sign, turn(2, 2) = 1;
      break;
    case 'z':
      turn(0, 0) = 1, turn(1, 2) = sign, turn(2, 1) = -sign;
      break;
    default:
      turn(0, 0) = 1, turn(1, 1) = sign, turn(2, 2) = sign;
  }
  return turn;
}

/// Where the joints are, in the file's axes and units, at some times of the first clip: a matrix each, 3 x joints.
std::vector<Eigen::Matrix3Xd> joints_over_time(const Scene& scene) {
  std::vector<Eigen::Matrix3Xd> frames;
  const SceneClip* clip = scene.clips.empty() ? nullptr : &scene.clips.front();
  const ClipRange range = clip ? range_of(*clip) : ClipRange{};
  for (int f = 0; f <= kFramesLookedAt; ++f) {
    const std::vector<Eigen::Affine3d> poses = node_poses(scene, clip, range.start_s + range.length_s() * f / kFramesLookedAt);
    Eigen::Matrix3Xd joints(3, static_cast<Eigen::Index>(poses.size()));
    for (std::size_t n = 0; n < poses.size(); ++n) joints.col(static_cast<Eigen::Index>(n)) = poses[n].translation();
    frames.push_back(std::move(joints));
  }
  return frames;
}

/// How far the lowest joints are from a floor through the origin, and how much they wander, along an axis of the file [of
/// the largest extent].
double floor_misfit(const std::vector<Eigen::Matrix3Xd>& frames, int axis) {
  double mean = 0, least = 0, most = 0, extent = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const double low = frames[f].row(axis).minCoeff();
    mean += low / static_cast<double>(frames.size());
    least = f == 0 ? low : std::min(least, low);
    most = f == 0 ? low : std::max(most, low);
    extent = std::max(extent, (frames[f].rowwise().maxCoeff() - frames[f].rowwise().minCoeff()).maxCoeff());
  }
  return extent > 0 ? (std::abs(mean) + most - least) / extent : 0;
}

std::string percent(double share) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%.0f %%", 100 * share);
  return text.data();
}

void guess_up(Scene& scene, const std::vector<Eigen::Matrix3Xd>& frames) {
  const double y = floor_misfit(frames, 1), z = floor_misfit(frames, 2);
  scene.up = z < kSurer * y ? "z" : "y";
  scene.to_y_up = turn_up(scene.up);
  scene.warnings.push_back(
      "A BVH file tells no axes: " + scene.up + " is taken to be up, for the lowest joints are off one floor by " +
      percent(scene.up == "z" ? z : y) + " of the size along " + scene.up + ", by " + percent(scene.up == "z" ? y : z) +
      " along " + (scene.up == "z" ? "y" : "z") + "; --up says otherwise.");
}

void guess_unit(Scene& scene, const std::vector<Eigen::Matrix3Xd>& frames) {
  const Eigen::RowVectorXd heights = (scene.to_y_up * frames.front()).row(1);
  const double height = heights.maxCoeff() - heights.minCoeff();
  std::string unit = "metres";
  scene.metres_per_unit = 1;
  if (height > 0 && (height < kSmallest || height > kLargest)) {
    const auto usual = std::find_if(kUnits.begin(), kUnits.end(), [&](const auto& candidate) {
      return height * candidate.first >= kShortPerson && height * candidate.first <= kTallPerson;
    });
    scene.metres_per_unit = usual == kUnits.end() ? kPerson / height : usual->first;
    unit = usual == kUnits.end() ? "such that a person of 1.7 m stands there" : usual->second;
  }
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(),
                "A BVH file tells no unit: its numbers are taken to be %s (%.4g m each), for the first pose is %.4g of them "
                "high, which "
                "makes %.3g m; --unit says otherwise.",
                unit.c_str(), scene.metres_per_unit, height, height * scene.metres_per_unit);
  scene.warnings.emplace_back(text.data());
}

}  // namespace

void settle_axes(Scene& scene, const std::string& up, double metres_per_unit) {
  const bool guess = scene.format == "bvh" && !scene.nodes.empty();
  const std::vector<Eigen::Matrix3Xd> frames =
      guess && (up.empty() || metres_per_unit == 0) ? joints_over_time(scene) : std::vector<Eigen::Matrix3Xd>{};
  if (!up.empty()) {
    scene.up = up;
    scene.to_y_up = turn_up(up);
  } else if (guess) {
    guess_up(scene, frames);
  }
  if (metres_per_unit > 0) {
    scene.metres_per_unit = metres_per_unit;
  } else if (guess) {
    guess_unit(scene, frames);
  }
}

}  // namespace hydrostat::io

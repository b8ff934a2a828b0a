#include "retarget/mirror.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace hydrostat::retarget {
namespace {

constexpr double kOffImage = 0.05;         // of L: further off in the mean is no mirror image
constexpr double kMovesOffImage = 0.02;    // likewise of what moves, RMS
constexpr Eigen::Index kMostAsked = 1000;  // points whose images are looked for, evenly spread over their numbers

/// Mean distance [m] of the points of a to the nearest of b.
double mean_distance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  double sum = 0;
  for (const auto point : a.colwise()) sum += std::sqrt((b.colwise() - point).colwise().squaredNorm().minCoeff());
  return sum / static_cast<double>(a.cols());
}

Eigen::Matrix3Xd mirrored(Eigen::Matrix3Xd points, int axis, double middle) {
  points.row(axis) = 2 * middle - points.row(axis).array();
  return points;
}

/// Of each of the asked points, which one is nearest to its image.
std::vector<Eigen::Index> nearest_to_images(const Eigen::Matrix3Xd& points, const std::vector<Eigen::Index>& asked, int axis) {
  const Eigen::Matrix3Xd images = mirrored(points(Eigen::all, asked), axis, points.row(axis).mean());
  std::vector<Eigen::Index> nearest(asked.size());
  for (std::size_t k = 0; k < asked.size(); ++k)
    (points.colwise() - images.col(static_cast<Eigen::Index>(k))).colwise().squaredNorm().minCoeff(&nearest[k]);
  return nearest;
}

/// How far [m] a motion's points are off their images across an axis, RMS over points and frames.
double off_images(const Motion& points, int axis) {
  Eigen::Matrix3Xd pose = Eigen::Matrix3Xd::Zero(3, points.frames.rows() / 3);  // the mean one: in a single frame feet may meet
  for (Eigen::Index f = 0; f < points.count(); ++f) pose += points.at(f).colwise() - points.at(f).rowwise().mean();
  pose /= static_cast<double>(points.count());
  std::vector<Eigen::Index> asked;
  for (Eigen::Index p = 0; p < pose.cols(); p += (pose.cols() + kMostAsked - 1) / kMostAsked) asked.push_back(p);
  const std::vector<Eigen::Index> twins = nearest_to_images(pose, asked, axis);
  double squared = 0;
  for (Eigen::Index f = 0; f < points.count(); ++f) {
    const Eigen::Matrix3Xd x = points.at(f), images = mirrored(x(Eigen::all, asked), axis, x.row(axis).mean());
    squared += (x(Eigen::all, twins) - images).squaredNorm() / static_cast<double>(asked.size());
  }
  return std::sqrt(squared / static_cast<double>(points.count()));
}

}  // namespace

std::optional<int> mirror_axis(const Motion& points, double length) {
  const double off_x = off_images(points, 0), off_z = off_images(points, 2);
  if (!(std::min(off_x, off_z) < kMovesOffImage * length)) return std::nullopt;
  return off_z < off_x ? 2 : 0;
}

bool is_mirror_image(const Eigen::Matrix3Xd& pose, int axis, double length) {
  Motion still;
  still.frames = pose.reshaped();
  return off_images(still, axis) < kMovesOffImage * length;
}

std::vector<std::array<int, 2>> mirrored_bones(const Eigen::Matrix3Xd& rest, const std::vector<int>& bone_of_point, double length) {
  int across = 0;
  double middle = 0, least = std::numeric_limits<double>::infinity();
  for (const int axis : {0, 2}) {
    const double here = 0.5 * (rest.row(axis).minCoeff() + rest.row(axis).maxCoeff());
    const double off = mean_distance(mirrored(rest, axis, here), rest);
    if (off < least) across = axis, middle = here, least = off;
  }

  std::map<int, std::vector<Eigen::Index>> members;
  for (std::size_t p = 0; p < bone_of_point.size(); ++p) members[bone_of_point[p]].push_back(static_cast<Eigen::Index>(p));
  std::map<int, Eigen::Matrix3Xd> points;
  for (const auto& [bone, own] : members) points[bone] = rest(Eigen::all, own);
  std::map<int, int> nearest;  // the bone itself where none is near
  for (const auto& [bone, own] : points) {
    const Eigen::Matrix3Xd image = mirrored(own, across, middle);
    double nearest_off = kOffImage * length;
    nearest[bone] = bone;
    for (const auto& [other, theirs] : points) {
      const double off = 0.5 * (mean_distance(image, theirs) + mean_distance(theirs, image));
      if (off < nearest_off) nearest[bone] = other, nearest_off = off;
    }
  }
  std::vector<std::array<int, 2>> pairs;
  for (const auto& [bone, other] : nearest) {
    if (bone < other && nearest.at(other) == bone) pairs.push_back({bone, other});
  }
  return pairs;
}

}  // namespace hydrostat::retarget

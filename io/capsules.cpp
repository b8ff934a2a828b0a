#include "io/capsules.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "io/rig_skin.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr int kSides = 10, kRings = 3;                                     // of each half ball
constexpr double kOfLength = 1.0 / 3, kThinnest = 0.02, kThickest = 0.05;  // radius, of the bone; of the skeleton's extent
constexpr double kShortest = 1e-3;                                         // bone, of the skeleton's extent

/// A closed capsule from a to b: a pole, rings along the two half balls, a pole. All its vertices go with one bone.
void add_capsule(retarget::SkinnedMesh& skin, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, int bone) {
  const Eigen::Vector3d along = (b - a).normalized();
  const Eigen::Vector3d across = along.unitOrthogonal(), third = along.cross(across);
  const int first = static_cast<int>(skin.vertices.cols()), rings = 2 * kRings;
  const int count = 2 + rings * kSides;
  skin.vertices.conservativeResize(Eigen::NoChange, first + count);
  int v = first;
  skin.vertices.col(v++) = a - radius * along;
  for (int ring = 0; ring < rings; ++ring) {
    const bool upper = ring >= kRings;
    const double angle = std::numbers::pi / 2 * (upper ? ring - kRings : ring + 1 - kRings) / kRings;  // from the equator
    for (int side = 0; side < kSides; ++side) {
      const double turn = 2 * std::numbers::pi * side / kSides;
      skin.vertices.col(v++) =
          (upper ? b : a) +
          radius * (std::sin(angle) * along + std::cos(angle) * (std::cos(turn) * across + std::sin(turn) * third));
    }
  }
  skin.vertices.col(v) = b + radius * along;
  std::vector<Eigen::Vector3i> faces;
  const auto at = [&](int ring, int side) { return first + 1 + ring * kSides + side % kSides; };
  for (int side = 0; side < kSides; ++side) {
    faces.emplace_back(first, at(0, side + 1), at(0, side));
    for (int ring = 0; ring + 1 < rings; ++ring) {
      faces.emplace_back(at(ring, side), at(ring, side + 1), at(ring + 1, side + 1));
      faces.emplace_back(at(ring, side), at(ring + 1, side + 1), at(ring + 1, side));
    }
    faces.emplace_back(v, at(rings - 1, side), at(rings - 1, side + 1));
  }
  const Eigen::Index triangles = skin.triangles.cols();
  skin.triangles.conservativeResize(Eigen::NoChange, triangles + static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f) skin.triangles.col(triangles + static_cast<Eigen::Index>(f)) = faces[f];
  for (int i = 0; i < count; ++i) skin.skin_weights.push_back({{bone, 1}});
}

/// The joints that bones run from or to; what hangs on none and bears none is a camera, a light or a mark.
std::vector<int> jointed(const retarget::Skeleton& skeleton) {
  std::vector<bool> is_jointed(static_cast<std::size_t>(skeleton.count()), false);
  for (std::size_t child = 0; child < is_jointed.size(); ++child) {
    const int bone = skeleton.parents[child];
    if (bone >= 0) is_jointed[child] = is_jointed[static_cast<std::size_t>(bone)] = true;
  }
  std::vector<int> result;
  for (int j = 0; j < skeleton.count(); ++j) {
    if (is_jointed[static_cast<std::size_t>(j)]) result.push_back(j);
  }
  return result;
}

}  // namespace

void add_capsules(Rig& rig, const std::string& path) {
  retarget::Skeleton& skeleton = rig.skeleton;
  Eigen::Matrix3Xd joints(3, skeleton.count());
  for (int j = 0; j < skeleton.count(); ++j) joints.col(j) = skeleton.bind_pose[static_cast<std::size_t>(j)].translation();
  const std::vector<int> bony = jointed(skeleton);
  const double extent = bony.empty() ? 0 : extent_of(joints(Eigen::all, bony));
  int capsules = 0;
  for (int child = 0; child < skeleton.count(); ++child) {
    const int bone = skeleton.parents[static_cast<std::size_t>(child)];
    if (bone < 0) continue;
    const double length = (joints.col(child) - joints.col(bone)).norm();
    if (!(length > kShortest * extent)) continue;
    add_capsule(rig.skin, joints.col(bone), joints.col(child),
                std::clamp(kOfLength * length, kThinnest * extent, kThickest * extent), bone);
    skeleton.weighted[static_cast<std::size_t>(bone)] = true;
    ++capsules;
  }
  if (capsules == 0)
    throw Error(path, "skeleton", "no bone has a length", "Export a skeleton of more than one joint, or a skinned mesh");
  rig.warnings.push_back("There is no mesh: " + std::to_string(capsules) + " capsules along the bones are the body.");
}

}  // namespace hydrostat::io

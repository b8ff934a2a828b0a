#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "retarget/clip.h"

namespace hydrostat::retarget {

/// A closed box of skin, each side cut into `cuts` squares along an edge, all of it on one bone.
inline SkinnedMesh box_skin(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int bone = 0, int cuts = 4) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;
  for (int axis = 0; axis < 3; ++axis) {
    for (int end = 0; end < 2; ++end) {
      const int first = static_cast<int>(points.size());
      for (int i = 0; i <= cuts; ++i) {
        for (int j = 0; j <= cuts; ++j) {
          Eigen::Vector3d share;
          share[axis] = end;
          share[(axis + 1) % 3] = static_cast<double>(end ? i : j) / cuts;
          share[(axis + 2) % 3] = static_cast<double>(end ? j : i) / cuts;
          points.push_back(low + share.cwiseProduct(high - low));
        }
      }
      for (int i = 0; i < cuts; ++i) {
        for (int j = 0; j < cuts; ++j) {
          const int a = first + i * (cuts + 1) + j;
          triangles.emplace_back(a, a + cuts + 1, a + cuts + 2);
          triangles.emplace_back(a, a + cuts + 2, a + 1);
        }
      }
    }
  }
  SkinnedMesh skin;
  skin.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  skin.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t i = 0; i < points.size(); ++i) skin.vertices.col(static_cast<Eigen::Index>(i)) = points[i];
  for (std::size_t i = 0; i < triangles.size(); ++i) skin.triangles.col(static_cast<Eigen::Index>(i)) = triangles[i];
  skin.skin_weights.assign(points.size(), {{bone, 1.0}});
  return skin;
}

/// A box bent onto the ellipsoid that it holds.
inline SkinnedMesh ball_skin(const Eigen::Vector3d& radii, int cuts = 16) {
  SkinnedMesh skin = box_skin({-1, -1, -1}, {1, 1, 1}, 0, cuts);
  for (Eigen::Index v = 0; v < skin.vertices.cols(); ++v)
    skin.vertices.col(v) = radii.cwiseProduct(skin.vertices.col(v).normalized());
  return skin;
}

/// Both skins, each with shells of its own.
inline SkinnedMesh joined(const SkinnedMesh& a, const SkinnedMesh& b) {
  SkinnedMesh both = a;
  both.vertices.conservativeResize(3, a.vertices.cols() + b.vertices.cols());
  both.vertices.rightCols(b.vertices.cols()) = b.vertices;
  both.triangles.conservativeResize(3, a.triangles.cols() + b.triangles.cols());
  both.triangles.rightCols(b.triangles.cols()) = b.triangles.array() + static_cast<int>(a.vertices.cols());
  both.skin_weights.insert(both.skin_weights.end(), b.skin_weights.begin(), b.skin_weights.end());
  return both;
}

/// Bones at the given places [m], unturned.
inline Skeleton skeleton_of(const std::vector<int>& parents, const std::vector<Eigen::Vector3d>& places) {
  Skeleton skeleton;
  for (std::size_t b = 0; b < parents.size(); ++b) {
    skeleton.names.push_back("bone" + std::to_string(b));
    skeleton.parents.push_back(parents[b]);
    skeleton.bind_pose.emplace_back(Eigen::Translation3d(places[b]));
    skeleton.weighted.push_back(true);
  }
  return skeleton;
}

inline Skeleton one_bone() { return skeleton_of({-1}, {Eigen::Vector3d::Zero()}); }

/// A worm along z, 0.6 m long and 0.07 m thick, on twelve bones whose weights fade into each other.
inline Character worm() {
  constexpr int kBones = 12;
  Character worm;
  std::vector<int> parents;
  std::vector<Eigen::Vector3d> places;
  for (int b = 0; b < kBones; ++b) {
    parents.push_back(b - 1);
    places.emplace_back(0, 0, 0.05 * b);
  }
  worm.skeleton = skeleton_of(parents, places);
  worm.skin = box_skin({-0.035, -0.035, 0}, {0.035, 0.035, 0.6}, 0, 24);
  for (Eigen::Index v = 0; v < worm.skin.vertices.cols(); ++v) {
    const double along = std::clamp(worm.skin.vertices(2, v) / 0.05 - 0.5, 0.0, kBones - 1.0);
    const int bone = std::min(static_cast<int>(along), kBones - 2);
    worm.skin.skin_weights[static_cast<std::size_t>(v)] = {{bone, 1 - (along - bone)}, {bone + 1, along - bone}};
  }
  return worm;
}

/*        +-----------+   Two legs under a beam. Bones: 0 the beam, 1 and 2 left leg, 3 and 4 right leg (upper, lower);
 *        |   beam    |   the way from lower leg to lower leg is four bones long.
 *        +---+---+---+
 *        | L | | | R |
 *        +---+   +---+   `gap` [m] is the air between the legs; the beam is 0.2 m high, the legs 0.8 m, all 0.3 m thick. */
inline Character two_legged(double gap) {
  Character body;
  const double out = gap / 2 + 0.3;
  body.skeleton =
      skeleton_of({-1, 0, 1, 0, 3},
                  {{0, 0.9, 0}, {out - 0.15, 0.8, 0}, {out - 0.15, 0.4, 0}, {0.15 - out, 0.8, 0}, {0.15 - out, 0.4, 0}});
  body.skin = box_skin({-out, 0.78, 0}, {out, 1, 0.3}, 0, 8);
  for (const double side : {1.0, -1.0}) {
    const double low = side > 0 ? gap / 2 : -out;
    SkinnedMesh leg = box_skin({low, 0, 0}, {low + 0.3, 0.8, 0.3}, side > 0 ? 2 : 4, 8);
    body.skin = joined(body.skin, leg);
  }
  return body;
}

}  // namespace hydrostat::retarget

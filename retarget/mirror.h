#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "retarget/motion.h"

namespace hydrostat::retarget {

/// The axis, 0 (x) or 2 (z), across which a motion of points is its own mirror image in every frame, by a plane that moves along: frames'
/// points are less than 2 % of length [m], L, off their images, RMS, and nearer than across the other. None: it is not. What hops is, what
/// steps is not.
std::optional<int> mirror_axis(const Motion& points, double length);

/// Whether a pose, 3 x P [m], is so across that axis.
bool is_mirror_image(const Eigen::Matrix3Xd& pose, int axis, double length);

/// Pairs of bones whose contact points are mirror images at rest, each bone in one pair at most. The plane goes through the middle of all
/// points, across x or z, by which all of them are nearer to their images. `rest` 3 x P [m], `bone_of_point` P. Within 5 % of length
/// [m], L, points count as images in the mean, for skins and rigs are drawn by hand.
std::vector<std::array<int, 2>> mirrored_bones(const Eigen::Matrix3Xd& rest, const std::vector<int>& bone_of_point, double length);

}  // namespace hydrostat::retarget

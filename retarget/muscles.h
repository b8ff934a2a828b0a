#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "physics/body.h"
#include "retarget/clip.h"

namespace hydrostat::retarget {

/// Strain fields over the rest body, per bone region and in the bone's frame: the handles for feedback and editing.
/// Muscle k changes the activation of constraint e by fields(e, k) per unit.
struct Muscles {
  std::vector<std::string> names;        // "<bone>/stretch", "<bone>/bend_x", ...; M
  std::vector<std::string> edge_bone;    // E, the region that owns each constraint most
  Eigen::MatrixXd fields;                // E x M, largest entry of a column is 1
};

/// Nine fields for each bone region: stretch, squeeze_x, squeeze_y, shear_xy, shear_yz, shear_xz, bend_x, bend_y, twist, with z
/// along the bone. Bones with little body join their parents until at most `most_regions` are left.
/// `bone_weights` B x N says which bone owns which node.
Muscles make_muscles(const physics::Body& body, const Skeleton& skeleton, const Eigen::MatrixXd& bone_weights, int most_regions = 13);

}  // namespace hydrostat::retarget

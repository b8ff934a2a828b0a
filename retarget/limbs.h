#pragma once

#include <Eigen/Core>

#include "retarget/clip.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// For each pair of bones whether they belong to different limbs; B x B, symmetric.
using LimbTable = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic>;

/// Bones belong to different limbs where neither is the other's ancestor and the way between them along the skeleton is four
/// bones or longer. Bones of different roots are not told apart.
LimbTable bones_of_different_limbs(const Skeleton& skeleton);

/// Marks the patches on legs: their bone, that of another patch and a third bone are of three limbs. A chain has two at most, to either
/// side of its root.
void find_legs(const Skeleton& skeleton, ContactSchedule& contacts);

/// The bone of greatest weight of each skin vertex, the first of equals; V.
Eigen::VectorXi dominant_bones(const SkinnedMesh& skin);

}  // namespace hydrostat::retarget

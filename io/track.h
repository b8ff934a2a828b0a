#pragma once

#include <Eigen/Core>
#include <string>

#include "io/scene.h"

namespace hydrostat::io {

/// Makes the keys of a track such that value_at() needs to ask nothing: of two keys at one time the later stays, quaternions
/// get unit length and, where they are joined straight, one hemisphere. Throws Error with `file` and `where` for a number
/// that is not finite, for times that descend and for a zero quaternion.
void make_sound(Track& track, const std::string& file, const std::string& where);

/// The value at a time [s]: before the first key it is the first key's, after the last the last key's. Rotations come out as
/// unit quaternions x y z w. The track must have keys. Source: cubic Hermite and great arc as glTF 2.0, appendix C.
Eigen::VectorXd value_at(const Track& track, double time_s);

}  // namespace hydrostat::io

#pragma once

#include <string>
#include <vector>

#include "retarget/performance.h"

namespace hydrostat::retarget {

/// One sentence for each thing that an animator should know about a target: what it lacks (with frame and patch), and whether
/// its constraints fit the limit of |activation - 1|.
std::vector<std::string> target_warnings(const PreparedTarget& prepared, const physics::Body& body, double limit,
                                         bool limit_is_automatic);

/// The same about what the inverse dynamics found.
std::vector<std::string> inverse_warnings(const InverseReport& inverse);

/// That a creature stays up on calmer feedback alone (perform_calmly); none where the usual one will do.
std::vector<std::string> feedback_warnings(const Performances& performances);

}  // namespace hydrostat::retarget

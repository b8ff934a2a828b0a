#pragma once

#include "retarget/motion.h"

namespace hydrostat::retarget {

/// Whittaker's smoother (penalty on third differences) over the padded frames; half amplitude at `cutoff_hz`.
Motion smooth(const Motion& motion, double cutoff_hz);

}  // namespace hydrostat::retarget

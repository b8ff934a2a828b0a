#pragma once

#include <Eigen/Core>

#include "retarget/performance.h"

namespace hydrostat::retarget {

/// Effects of the picture: nothing of them acts on the body.

/// The skin's vertices [m] 3V x F, carried by the nodes of a motion alone.
Eigen::MatrixXd embedded_motion(const Performer& performer, const Motion& motion);

/// The same with the offsets of the flesh that swings, turned as the nodes that carry them; without wobble as embedded_motion.
Eigen::MatrixXd wobbled_motion(const Performer& performer, const Motion& motion);

/// Cost of the skin that follows the nodes, at 60 frames a second [ms for a simulated second], and of wobble, 0 where it is off, at the
/// target's.
double embedding_ms_per_sim_s(const Performer& performer);
double wobble_ms_per_sim_s(const Performer& performer);

}  // namespace hydrostat::retarget

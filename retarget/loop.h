#pragma once

#include "physics/body.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// By how much the points at the end of a loop miss where its travel and turn take those of the start; [m] 3 x N.
Eigen::Matrix3Xd closure_defect(const Motion& loop, const Eigen::Ref<const Eigen::Matrix3Xd>& start,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& end);

/// How the points move at a share of the period, 0..1, so that the defect closes: half of it at either end, fading to nothing in the
/// middle with flat slopes at the seam; the first half sees it before the turn. [m] 3 x N.
Eigen::Matrix3Xd closure_move(const Motion& loop, double share, const Eigen::Ref<const Eigen::Matrix3Xd>& defect);

/// If the last frame repeats the first up to a horizontal travel and a turn about y, within `tolerance` [m] RMS, the loop:
/// one period without the repeated frame, its closure defect spread by a smooth ramp. Otherwise the motion as it is.
/// `mass` weighs the points, N.
Motion close_loop(const Motion& frames, const Eigen::VectorXd& mass, double tolerance, double* defect = nullptr);

/// Whether the clip begins and ends in stillness and is in the air between, by `flight_height` [m]: a jump, which is no loop
/// though its last pose may be its first.
bool was_made_to_be_played_once(const Motion& frames, const Eigen::VectorXd& mass, double flight_height);

}  // namespace hydrostat::retarget

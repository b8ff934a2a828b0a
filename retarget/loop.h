#pragma once

#include "physics/body.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// By how much the points at the end of a loop miss where its travel and turn take those of the start; [m] 3 x N.
Eigen::Matrix3Xd closure_defect(const Motion& loop, const Eigen::Ref<const Eigen::Matrix3Xd>& start,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& end);

/// Share of the defect to add at a share of the period, 0..1: half at the start, minus half at the end, fading to nothing in the
/// middle, with flat slopes at the seam.
double closure_ramp(double share);

/// If the last frame repeats the first up to a horizontal travel and a turn about y, within `tolerance` [m] RMS, the loop:
/// one period without the repeated frame, its closure defect spread by a smooth ramp. Otherwise the motion as it is.
/// `mass` weighs the points, N.
Motion close_loop(const Motion& frames, const Eigen::VectorXd& mass, double tolerance, double* defect = nullptr);

}  // namespace hydrostat::retarget

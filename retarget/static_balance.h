#pragma once

#include "retarget/motion.h"

namespace hydrostat::retarget {

/// What of their mass the nodes keep so that a body stands on its feet. Characters are drawn by eye: with one density a spider's
/// belly, half of its mass, hangs over behind its hind feet, and no activation keeps it from tipping over them.
struct StaticBalance {
  Eigen::VectorXd mass_shares;  // N, in (0, 1]; 1 for all where the body stands as it is
  double overhang = 0;          // [m] by which the centre of mass was outside the feet, 0 where it was not
  bool stands = true;           // with these shares
};

/// Over the frames in which something is on the ground the mean of the centre of mass must lie within the mean reach of what
/// bears it, in each of sixteen directions that turn with the body: while the weight is borne, its moments about the contacts add
/// up to none over a loop. Where it does not, masses become less, the more the further a node is outside, as little in squares as
/// brings the centre of mass a quarter of the support's width inside, none by more than to a fifth.
/// nodes 3N x F, points 3P x F [m], ground y = 0; mass N [kg]; what of the points is lower than `height` [m] bears.
StaticBalance balance_statically(const Motion& nodes, const Motion& points, const Eigen::VectorXd& mass, double height);

}  // namespace hydrostat::retarget

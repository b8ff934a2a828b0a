#pragma once

#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// How far a body sinks under its own weight while it stands as planned, its muscles at rest [per L]: the work of its weight over m g L, with
/// the stiffness of the planned pose, without the part by which compression softens it, and the nodes about its touching points held. The
/// median over the moments in which something touches and holds all of the body; 0 where there is none, or no weight.
/// length [m] is L; `scene` has the body's springs (preparation_scene).
/// It is no buckling load; it stands for one, for it is one linear solution, and tells bodies whose legs buckle from all others that were measured.
double sag(const physics::Scene& scene, const PreparedTarget& prepared, double length);

/// How many times as stiff the body has to be, so that it sinks by kMostSag at most: from 1 to kMostStiffening, for what touches the ground
/// with a fingertip alone does not stand on it. Legs that sink further buckle: what they bear takes away more of their stiffness than
/// feedback makes good (a spider on 782 nodes, 9 % of L).
double stiffness_to_bear(double sag);
constexpr double kMostSag = 0.02;  // of L
constexpr double kMostStiffening = 8;

/// Springs, volumes, dashpots and elements, by a factor.
void stiffen(double factor, physics::Body& body);

}  // namespace hydrostat::retarget

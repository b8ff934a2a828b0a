#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/internal_forces.h"
#include "physics/stepper.h"
#include "retarget/contacts.h"
#include "retarget/muscles.h"

namespace hydrostat::retarget {

/// One moment of a planned motion.
struct PlannedMoment {
  physics::State state;
  Eigen::VectorXd activation;          // E
  std::vector<ContactState> touching;  // P, by plan
  std::vector<int> patch;              // P: index of the patch whose the point is; -1 where it does not touch
};

/// A few ways to move that stand for all 3N: fields over the nodes, orthonormal by mass.
struct ReducedModes {
  Eigen::MatrixXd fields;   // 3N x R [1/sqrt(kg)]
  Eigen::MatrixXd project;  // R x 3N [sqrt(kg)]: fields^T M, the inverse on what the fields span

  Eigen::Index count() const { return fields.cols(); }
};

/// The `most` ways in which a body moves most where its muscles, its contact points and rigid moves act on it in some moments of a
/// motion, for times from a substep's to a slow sway's (1/120 to 0.15 s): principal components by kinetic energy, each answer counting alike. Those modes have
/// the body's own compliance, as bones' rigid moves have not. Contact holds as MuscleResponse has it.
/// Source: Sirovich, "Turbulence and the dynamics of coherent structures", Quarterly of Applied Mathematics 45(3), 1987 (snapshots);
/// that the snapshots are answers to what drives the body is ours.
ReducedModes find_reduced_modes(const physics::Scene& scene, const Muscles& muscles, const std::vector<PlannedMoment>& moments, double length,
                                int most);

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/SparseCore>

namespace hydrostat::retarget {

/// Vibration modes K phi = w^2 M phi of a body that is held somewhere.
struct Vibration {
  Eigen::MatrixXd shapes;             // n x m, with shapes^T M shapes = 1; the largest component of each is positive
  Eigen::VectorXd squared_frequency;  // m, ascending [rad2/s2]
};

/// The `count` lowest modes (fewer where there are fewer unknowns) of a symmetric positive definite stiffness, n x n [N/m],
/// and lumped masses, n, > 0 [kg]. Squared frequencies are exact to 1e-6; modes that have not settled to it after 60 rounds are left
/// out. Deterministic. Without modes where the stiffness is not positive definite.
/// Source: Bathe and Wilson, "Solution methods for eigenvalue problems in structural mechanics", IJNME 6, 1973 (iteration of
/// a subspace).
Vibration lowest_modes(const Eigen::SparseMatrix<double>& stiffness, const Eigen::VectorXd& mass, Eigen::Index count);

}  // namespace hydrostat::retarget

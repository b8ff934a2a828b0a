#pragma once

#include <Eigen/SparseCholesky>
#include <vector>

#include "retarget/least_squares.h"

namespace hydrostat::retarget {

/// The free entries of a problem with coupled_rows, where C x - b are those rows and all others make one square d (x - w)^2 a
/// column. A column of a block of several is wide (A, unknowns y), the others are narrow (B, unknowns u). With the residuals
/// t = C x - b, u = w - B^T t / d for the free narrow columns, and the wide ones stay unknowns beside t:
///
///   [ D   A^T             ] [ y ]   [ D w                   ]
///   [ A   -(I + B B^T / d) ] [ t ] = [ b - B w - B_k u_k     ]    k: clamped
///
/// This matrix is quasi-definite, so L D L^T exists in any order of elimination; for a body of N nodes its factor grows with
/// little more than N. Where columns of u were eliminated last, as in the normal equations, all constraints of a node would couple.
/// Source: Vanderbei, "Symmetric Quasidefinite Matrices", SIAM J. Optimization 5(1), 1995, theorem 2.1.
class SaddleSystem {
 public:
  /// The problem must outlive the system; its coupled_rows is above 0.
  explicit SaddleSystem(const BoundedLeastSquares& problem);

  /// Solves for the columns whose side is 0, the others stay as they are in x; a barrier adds weight (x - target)^2 to narrow
  /// columns, or there is none (nullptr).
  void solve(const std::vector<int>& side, const Eigen::VectorXd* barrier_weight, const Eigen::VectorXd* barrier_target,
             Eigen::VectorXd& x);

 private:
  void find_pattern();
  /// Takes the free narrow columns' share from the lower right block.
  void factor(const std::vector<int>& side, const Eigen::VectorXd& weight);

  const int rows_, columns_;
  Eigen::SparseMatrix<double> by_column_;                  // C
  Eigen::SparseMatrix<double, Eigen::RowMajor> by_row_;    // C
  Eigen::VectorXd target_, weight_, pull_;                 // b; d; d w
  std::vector<int> wide_;                                  // columns
  std::vector<bool> is_wide_;                              // of each column
  Eigen::SparseMatrix<double> matrix_;                     // lower triangle; unknowns: y, t
  Eigen::VectorXd constant_values_;                        // what no choice of clamped entries changes
  std::vector<int> place_;                                 // of each unknown in the column of matrix_ at hand
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor_;
};

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/Sparse>
#include <vector>

namespace hydrostat::retarget {

/// minimise 1/2 |J x - b|^2 subject to lower <= x <= upper, with J sparse.
struct BoundedLeastSquares {
  Eigen::SparseMatrix<double, Eigen::RowMajor> jacobian;
  Eigen::VectorXd target;                 // b
  Eigen::VectorXd lower, upper;           // may be -+ infinity
  std::vector<int> row_blocks;            // first rows of the residual blocks, ending with the number of rows
  std::vector<int> column_blocks;         // first columns of the parameter blocks, ending with the number of columns
  /// Above 0: the rows from here on have one entry each and every column has at least one of them. The free entries are then
  /// found through the rows before, which are to be fewer than the columns.
  int coupled_rows = 0;
};

/// minimise 1/2 |rows x - target|^2 + 1/2 hold^2 |x|^2 subject to x >= 0, of a few rows that tie all unknowns together.
BoundedLeastSquares held_nonnegative(const Eigen::MatrixXd& rows, const Eigen::VectorXd& target, double hold);

struct BoundedSolution {
  Eigen::VectorXd x;
  double kkt_residual = 0;  // max violation of the optimality conditions [1]: gradient over the column's length times the target's, bounds exact
  int pivots = 0;
  bool converged = false;   // the active set stands: every clamped entry pushes against its bound, every free one is inside
};

/// Ceres solves for the free entries while the clamped ones are held; block principal pivoting over them (Portugal,
/// Judice, Vicente 1994) releases and clamps until the conditions of Karush, Kuhn and Tucker hold. Where that does not
/// settle, a primal-dual interior-point method (Wright, "Primal-Dual Interior-Point Methods", 1997), its steps solved by
/// Ceres too, comes near, and pivoting ends from there. With coupled_rows, a sparse factorisation of the saddle-point
/// system (saddle_system.h) takes Ceres' place: where many columns meet in a row, their normal equations are nearly full. A
/// column block of more than one entry must be unbounded. `start` says which entries begin clamped: those that lie on a bound.
BoundedSolution solve(const BoundedLeastSquares& problem, const Eigen::VectorXd& start, int max_pivots = 40);

}  // namespace hydrostat::retarget

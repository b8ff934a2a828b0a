#include "retarget/least_squares.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cassert>
#include <memory>

namespace hydrostat::retarget {
namespace {

/// Rows [begin, end) of J x - b, whose Jacobian is constant.
class LinearRows final : public ceres::CostFunction {
 public:
  LinearRows(const BoundedLeastSquares& problem, int begin, int end, const std::vector<int>& block_of_column,
             std::vector<int>& blocks)
      : target_(problem.target.segment(begin, end - begin)) {
    set_num_residuals(end - begin);
    for (int r = begin; r < end; ++r) {
      for (decltype(problem.jacobian)::InnerIterator it(problem.jacobian, r); it; ++it) {
        blocks.push_back(block_of_column[static_cast<std::size_t>(it.col())]);
      }
    }
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    for (const int block : blocks) {
      const int first = problem.column_blocks[static_cast<std::size_t>(block)];
      const int size = problem.column_blocks[static_cast<std::size_t>(block) + 1] - first;
      mutable_parameter_block_sizes()->push_back(size);
      jacobians_.push_back(RowMajorMatrix::Zero(end - begin, size));
    }
    for (int r = begin; r < end; ++r) {
      for (decltype(problem.jacobian)::InnerIterator it(problem.jacobian, r); it; ++it) {
        const int block = block_of_column[static_cast<std::size_t>(it.col())];
        const auto place = std::lower_bound(blocks.begin(), blocks.end(), block) - blocks.begin();
        jacobians_[static_cast<std::size_t>(place)](
            r - begin, it.col() - problem.column_blocks[static_cast<std::size_t>(block)]) = it.value();
      }
    }
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r = -target_;
    for (std::size_t b = 0; b < jacobians_.size(); ++b) {
      r.noalias() += jacobians_[b] * Eigen::Map<const Eigen::VectorXd>(parameters[b], jacobians_[b].cols());
      if (jacobians != nullptr && jacobians[b] != nullptr) {
        std::copy_n(jacobians_[b].data(), jacobians_[b].size(), jacobians[b]);
      }
    }
    return true;
  }

 private:
  // One column must be column-major for Eigen; the layout in memory is the same.
  using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::VectorXd target_;
  std::vector<RowMajorMatrix> jacobians_;
};

/// Projected coordinate descent from a feasible x: slow, but every step lowers the cost. For active sets that do not settle.
void descend_along_coordinates(const BoundedLeastSquares& problem, Eigen::VectorXd& x) {
  constexpr int kSweeps = 200;
  const Eigen::SparseMatrix<double> columns = problem.jacobian;
  Eigen::VectorXd residual = problem.jacobian * x - problem.target;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int c = 0; c < columns.cols(); ++c) {
      double slope = 0, curvature = 0;
      for (Eigen::SparseMatrix<double>::InnerIterator it(columns, c); it; ++it) {
        slope += it.value() * residual[it.row()];
        curvature += it.value() * it.value();
      }
      if (curvature == 0) continue;
      const double next = std::clamp(x[c] - slope / curvature, problem.lower[c], problem.upper[c]);
      for (Eigen::SparseMatrix<double>::InnerIterator it(columns, c); it; ++it) residual[it.row()] += (next - x[c]) * it.value();
      x[c] = next;
    }
  }
}

}  // namespace

BoundedSolution solve(const BoundedLeastSquares& problem, const Eigen::VectorXd& start, int max_pivots) {
  const int columns = static_cast<int>(problem.jacobian.cols());
  const int block_count = static_cast<int>(problem.column_blocks.size()) - 1;
  std::vector<int> block_of_column(static_cast<std::size_t>(columns));
  for (int b = 0; b < block_count; ++b) {
    for (int c = problem.column_blocks[static_cast<std::size_t>(b)]; c < problem.column_blocks[static_cast<std::size_t>(b) + 1]; ++c) {
      block_of_column[static_cast<std::size_t>(c)] = b;
    }
  }
  BoundedSolution solution;
  solution.x = start.cwiseMax(problem.lower).cwiseMin(problem.upper);
  Eigen::VectorXd& x = solution.x;

  ceres::Problem ceres_problem;
  for (int b = 0; b < block_count; ++b) {
    const int first = problem.column_blocks[static_cast<std::size_t>(b)];
    ceres_problem.AddParameterBlock(x.data() + first, problem.column_blocks[static_cast<std::size_t>(b) + 1] - first);
  }
  for (std::size_t k = 0; k + 1 < problem.row_blocks.size(); ++k) {
    std::vector<int> blocks;
    auto* rows = new LinearRows(problem, problem.row_blocks[k], problem.row_blocks[k + 1], block_of_column, blocks);
    std::vector<double*> parameters;
    for (const int b : blocks) parameters.push_back(x.data() + problem.column_blocks[static_cast<std::size_t>(b)]);
    ceres_problem.AddResidualBlock(rows, nullptr, parameters);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.initial_trust_region_radius = 1e16;
  options.max_trust_region_radius = 1e20;
  options.max_num_iterations = 4;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-16;
  options.parameter_tolerance = 1e-12;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;

  // -1: at the lower bound, +1: at the upper one, 0: free.
  std::vector<int> side(static_cast<std::size_t>(columns), 0);
  for (int c = 0; c < columns; ++c) {
    if (x[c] <= problem.lower[c]) side[static_cast<std::size_t>(c)] = -1;
    if (x[c] >= problem.upper[c]) side[static_cast<std::size_t>(c)] = 1;
  }
  const Eigen::VectorXd gradient_at_zero = problem.jacobian.transpose() * problem.target;
  const double gradient_scale = std::max(gradient_at_zero.lpNorm<Eigen::Infinity>(), 1e-300);

  int fewest_wrong = columns + 1, patience = 5;
  Eigen::VectorXd gradient;
  for (solution.pivots = 0; solution.pivots < max_pivots; ++solution.pivots) {
    for (int b = 0; b < block_count; ++b) {
      const int first = problem.column_blocks[static_cast<std::size_t>(b)];
      const int at = side[static_cast<std::size_t>(first)];
      if (at != 0) {
        assert(problem.column_blocks[static_cast<std::size_t>(b) + 1] == first + 1);
        x[first] = at < 0 ? problem.lower[first] : problem.upper[first];
        ceres_problem.SetParameterBlockConstant(x.data() + first);
      } else {
        ceres_problem.SetParameterBlockVariable(x.data() + first);
      }
    }
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_problem, &summary);
    gradient = problem.jacobian.transpose() * (problem.jacobian * x - problem.target);
    std::vector<int> wrong;
    for (int c = 0; c < columns; ++c) {
      const int at = side[static_cast<std::size_t>(c)];
      const double slack = 1e-9 * gradient_scale;
      const bool out = at == 0 && (x[c] < problem.lower[c] - 1e-12 || x[c] > problem.upper[c] + 1e-12);
      const bool pulls_inside = (at < 0 && gradient[c] < -slack) || (at > 0 && gradient[c] > slack);
      if (out || pulls_inside) wrong.push_back(c);
    }
    if (wrong.empty()) {
      solution.converged = true;
      break;
    }
    // All at once while that helps; one at a time (the last, Murty's rule) when it does not, which ends for sure.
    bool only_last = false;
    if (static_cast<int>(wrong.size()) < fewest_wrong) {
      fewest_wrong = static_cast<int>(wrong.size());
      patience = 5;
    } else if (patience > 0) {
      --patience;
    } else {
      only_last = true;
    }
    for (std::size_t k = only_last ? wrong.size() - 1 : 0; k < wrong.size(); ++k) {
      const int c = wrong[k];
      int& at = side[static_cast<std::size_t>(c)];
      at = at != 0 ? 0 : (x[c] < problem.lower[c] ? -1 : 1);
    }
  }
  x = x.cwiseMax(problem.lower).cwiseMin(problem.upper);
  if (!solution.converged) descend_along_coordinates(problem, x);
  gradient = problem.jacobian.transpose() * (problem.jacobian * x - problem.target);
  for (int c = 0; c < columns; ++c) {
    double violation = std::abs(gradient[c]);
    if (x[c] <= problem.lower[c]) violation = std::max(0.0, -gradient[c]);
    if (x[c] >= problem.upper[c]) violation = std::max(0.0, gradient[c]);
    solution.kkt_residual = std::max(solution.kkt_residual, violation / gradient_scale);
  }
  return solution;
}

}  // namespace hydrostat::retarget

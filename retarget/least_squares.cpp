#include "retarget/least_squares.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "retarget/saddle_system.h"

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

/// sqrt(weight) (x - target) for one column: the barrier of its bounds. Weight and target change from step to step.
class Barrier final : public ceres::SizedCostFunction<1, 1> {
 public:
  double weight = 0, target = 0;
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double root = std::sqrt(weight);
    residuals[0] = root * (parameters[0][0] - target);
    if (jacobians != nullptr && jacobians[0] != nullptr) jacobians[0][0] = root;
    return true;
  }
};

ceres::Solver::Options linear_solver_options() {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // CHOLMOD spins on threads of its own at these sizes
  options.initial_trust_region_radius = 1e16;
  options.max_trust_region_radius = 1e20;
  options.max_num_iterations = 1;  // linear: the first step lands
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-16;
  options.parameter_tolerance = 1e-12;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

constexpr int kPatience = 3;       // pivots that may pass without fewer wrong entries
constexpr double kSlack = 1e-11;   // cosine between a column and the residuals that counts as none

class BoundedSolver {
 public:
  BoundedSolver(const BoundedLeastSquares& problem, const Eigen::VectorXd& start)
      : problem_(problem), options_(linear_solver_options()), columns_(static_cast<int>(problem.jacobian.cols())), curvature_(Eigen::VectorXd::Zero(columns_)) {
    solution_.x = start.cwiseMax(problem.lower).cwiseMin(problem.upper);
    const int block_count = static_cast<int>(problem.column_blocks.size()) - 1;
    std::vector<int> block_of_column(static_cast<std::size_t>(columns_));
    for (int b = 0; b < block_count; ++b) {
      const int first = problem.column_blocks[static_cast<std::size_t>(b)], end = problem.column_blocks[static_cast<std::size_t>(b) + 1];
      for (int c = first; c < end; ++c) block_of_column[static_cast<std::size_t>(c)] = b;
      if (problem.coupled_rows == 0) ceres_.AddParameterBlock(solution_.x.data() + first, end - first);
    }
    if (problem.coupled_rows > 0) saddle_.emplace(problem);
    for (std::size_t k = 0; !saddle_ && k + 1 < problem.row_blocks.size(); ++k) {
      std::vector<int> blocks;
      auto* rows = new LinearRows(problem, problem.row_blocks[k], problem.row_blocks[k + 1], block_of_column, blocks);
      std::vector<double*> parameters;
      for (const int b : blocks) parameters.push_back(solution_.x.data() + problem.column_blocks[static_cast<std::size_t>(b)]);
      ceres_.AddResidualBlock(rows, nullptr, parameters);
    }
    side_.assign(static_cast<std::size_t>(columns_), 0);
    for (int c = 0; c < columns_; ++c) {
      if (solution_.x[c] <= problem.lower[c]) side_[static_cast<std::size_t>(c)] = -1;
      if (solution_.x[c] >= problem.upper[c]) side_[static_cast<std::size_t>(c)] = 1;
    }
    for (int r = 0; r < problem.jacobian.outerSize(); ++r) {
      for (decltype(problem.jacobian)::InnerIterator it(problem.jacobian, r); it; ++it) curvature_[it.col()] += it.value() * it.value();
    }
    const double size = std::max(problem.target.norm(), 1e-300);
    gradient_scale_ = (curvature_.cwiseSqrt() * size).cwiseMax(1e-300);
  }

  BoundedSolution solve(int max_pivots) {
    pivot(max_pivots);
    if (!solution_.converged) {
      approach_from_inside();
      const Eigen::VectorXd near = solution_.x;
      pivot(max_pivots);
      if (!solution_.converged) solution_.x = near;
    }
    solution_.x = solution_.x.cwiseMax(problem_.lower).cwiseMin(problem_.upper);
    measure_kkt_residual();
    return solution_;
  }

 private:
  Eigen::VectorXd gradient() const { return problem_.jacobian.transpose() * (problem_.jacobian * solution_.x - problem_.target); }

  void solve_free_entries() {
    for (std::size_t b = 0; b + 1 < problem_.column_blocks.size(); ++b) {
      const int first = problem_.column_blocks[b], at = side_[static_cast<std::size_t>(first)];
      double* block = solution_.x.data() + first;
      if (saddle_) {
        if (at != 0) *block = at < 0 ? problem_.lower[first] : problem_.upper[first];
        continue;
      }
      if (at == 0) {
        ceres_.SetParameterBlockVariable(block);
        continue;
      }
      assert(problem_.column_blocks[b + 1] == first + 1);
      *block = at < 0 ? problem_.lower[first] : problem_.upper[first];
      ceres_.SetParameterBlockConstant(block);
    }
    if (saddle_) return saddle_->solve(side_, nullptr, nullptr, solution_.x);
    ceres::Solver::Summary summary;
    ceres::Solve(options_, &ceres_, &summary);
  }

  /// Free entries outside their bounds, and clamped ones that the gradient pulls inside.
  std::vector<int> wrong_entries() const {
    const Eigen::VectorXd slope = gradient();
    std::vector<int> wrong;
    for (int c = 0; c < columns_; ++c) {
      const double slack = kSlack * gradient_scale_[c];
      const int at = side_[static_cast<std::size_t>(c)];
      const bool out = at == 0 && (solution_.x[c] < problem_.lower[c] - 1e-12 || solution_.x[c] > problem_.upper[c] + 1e-12);
      const bool pulls_inside = (at < 0 && slope[c] < -slack) || (at > 0 && slope[c] > slack);
      if (out || pulls_inside) wrong.push_back(c);
    }
    return wrong;
  }

  /// Block principal pivoting: changes all wrong entries at once while their number falls, with some patience.
  void pivot(int max_pivots) {
    int fewest_wrong = columns_ + 1, patience = kPatience;
    for (int k = 0; k < max_pivots; ++k) {
      solve_free_entries();
      ++solution_.pivots;
      const std::vector<int> wrong = wrong_entries();
      solution_.converged = wrong.empty();
      if (solution_.converged) return;
      if (static_cast<int>(wrong.size()) < fewest_wrong) {
        fewest_wrong = static_cast<int>(wrong.size());
        patience = kPatience;
      } else if (--patience < 0) {
        return;
      }
      for (const int c : wrong) {
        int& at = side_[static_cast<std::size_t>(c)];
        at = at != 0 ? 0 : (solution_.x[c] < problem_.lower[c] ? -1 : 1);
      }
    }
  }

  /// Primal-dual interior point: slower, but it always gets near. Leaves the solution and the active set that it points to.
  void approach_from_inside();
  void measure_kkt_residual();

  const BoundedLeastSquares& problem_;
  const ceres::Solver::Options options_;
  const int columns_;
  ceres::Problem ceres_;
  std::optional<SaddleSystem> saddle_;  // in the place of ceres_
  BoundedSolution solution_;
  std::vector<int> side_;  // -1: clamped at the lower bound, +1: at the upper one, 0: free
  Eigen::VectorXd curvature_, gradient_scale_;  // per column: its square, and its length times the target's
};

void BoundedSolver::approach_from_inside() {
  constexpr int kSteps = 60;
  constexpr double kToBoundary = 0.99, kCentring = 0.1, kGap = 1e-10;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::VectorXd& x = solution_.x;
  const Eigen::VectorXd &lower = problem_.lower, &upper = problem_.upper;
  std::vector<int> bounded;
  std::vector<Barrier*> barriers;
  std::vector<ceres::ResidualBlockId> blocks;
  for (std::size_t b = 0; b + 1 < problem_.column_blocks.size(); ++b) {
    const int c = problem_.column_blocks[b];
    if (!saddle_) ceres_.SetParameterBlockVariable(x.data() + c);
    if (lower[c] == -kInfinity && upper[c] == kInfinity) continue;
    const double width = std::min(upper[c] - lower[c], 1.0);
    x[c] = std::clamp(x[c], lower[c] + 0.1 * width, upper[c] - 0.1 * width);
    bounded.push_back(c);
    if (saddle_) continue;
    barriers.push_back(new Barrier);
    blocks.push_back(ceres_.AddResidualBlock(barriers.back(), nullptr, x.data() + c));
  }
  // Multipliers of the lower and upper bounds; those of infinite ones stay 0.
  const Eigen::VectorXd scale = Eigen::VectorXd::Constant(columns_, std::max(gradient().lpNorm<Eigen::Infinity>(), 1e-12));
  Eigen::VectorXd below = (lower.array() > -kInfinity).select(scale, 0), above = (upper.array() < kInfinity).select(scale, 0);
  Eigen::VectorXd barrier_weight = Eigen::VectorXd::Zero(columns_), barrier_target = barrier_weight;
  const std::vector<int> all_free(static_cast<std::size_t>(columns_), 0);
  const auto gap = [&](int c) {
    return (below[c] > 0 ? below[c] * (x[c] - lower[c]) : 0) + (above[c] > 0 ? above[c] * (upper[c] - x[c]) : 0);
  };
  for (int step = 0; step < kSteps; ++step) {
    double sum = 0;
    for (const int c : bounded) sum += gap(c);
    const double cost = 0.5 * (problem_.jacobian * x - problem_.target).squaredNorm(), mean_gap = sum / static_cast<double>(bounded.size());
    if (sum < kGap * cost) break;
    const double mu = kCentring * mean_gap;
    for (std::size_t k = 0; k < bounded.size(); ++k) {
      const int c = bounded[k];
      const double to_lower = x[c] - lower[c], to_upper = upper[c] - x[c];
      barrier_weight[c] = below[c] / to_lower + above[c] / to_upper;
      barrier_target[c] = x[c] + (mu / to_lower - mu / to_upper) / barrier_weight[c];
      if (saddle_) continue;
      barriers[k]->weight = barrier_weight[c];
      barriers[k]->target = barrier_target[c];
    }
    const Eigen::VectorXd before = x;
    if (saddle_) {
      saddle_->solve(all_free, &barrier_weight, &barrier_target, x);
    } else {
      ceres::Solver::Summary summary;
      ceres::Solve(options_, &ceres_, &summary);
    }
    const Eigen::VectorXd move = x - before;
    Eigen::VectorXd below_move = Eigen::VectorXd::Zero(columns_), above_move = below_move;
    double primal = 1, dual = 1;
    const auto keep_positive = [](double value, double change, double& share) {
      if (change < 0) share = std::min(share, -kToBoundary * value / change);
    };
    for (const int c : bounded) {
      const double to_lower = before[c] - lower[c], to_upper = upper[c] - before[c];
      if (below[c] > 0) below_move[c] = (mu - below[c] * move[c]) / to_lower - below[c];
      if (above[c] > 0) above_move[c] = (mu + above[c] * move[c]) / to_upper - above[c];
      keep_positive(to_lower, move[c], primal);
      keep_positive(to_upper, -move[c], primal);
      keep_positive(below[c], below_move[c], dual);
      keep_positive(above[c], above_move[c], dual);
    }
    x = before + primal * move;
    below += dual * below_move;
    above += dual * above_move;
  }
  for (const int c : bounded) {
    int& at = side_[static_cast<std::size_t>(c)];
    at = 0;
    // Pressed against its bound more than it lies away from it.
    if (below[c] > curvature_[c] * (x[c] - lower[c])) at = -1;
    if (above[c] > curvature_[c] * (upper[c] - x[c])) at = 1;
  }
  for (const ceres::ResidualBlockId block : blocks) ceres_.RemoveResidualBlock(block);
}

void BoundedSolver::measure_kkt_residual() {
  const Eigen::VectorXd slope = gradient();
  for (int c = 0; c < columns_; ++c) {
    double violation = std::abs(slope[c]);
    if (solution_.x[c] <= problem_.lower[c]) violation = std::max(0.0, -slope[c]);
    if (solution_.x[c] >= problem_.upper[c]) violation = std::max(0.0, slope[c]);
    solution_.kkt_residual = std::max(solution_.kkt_residual, violation / gradient_scale_[c]);
  }
}

}  // namespace

BoundedLeastSquares held_nonnegative(const Eigen::MatrixXd& rows, const Eigen::VectorXd& target, double hold) {
  const Eigen::Index tied = rows.rows(), count = rows.cols();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(tied + count, count);
  all.topRows(tied) = rows;
  all.bottomRows(count).diagonal().setConstant(hold);
  BoundedLeastSquares problem;
  problem.jacobian = all.sparseView();
  problem.target = Eigen::VectorXd::Zero(tied + count);
  problem.target.head(tied) = target;
  problem.lower = Eigen::VectorXd::Zero(count);
  problem.upper = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity());
  problem.row_blocks.push_back(0);
  for (Eigen::Index k = 0; k <= count; ++k) {
    problem.row_blocks.push_back(static_cast<int>(tied + k));
    problem.column_blocks.push_back(static_cast<int>(k));
  }
  return problem;
}

BoundedSolution solve(const BoundedLeastSquares& problem, const Eigen::VectorXd& start, int max_pivots) {
  return BoundedSolver(problem, start).solve(max_pivots);
}

}  // namespace hydrostat::retarget

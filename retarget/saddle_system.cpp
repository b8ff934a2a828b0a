#include "retarget/saddle_system.h"

namespace hydrostat::retarget {

SaddleSystem::SaddleSystem(const BoundedLeastSquares& problem)
    : rows_(problem.coupled_rows),
      columns_(static_cast<int>(problem.jacobian.cols())),
      by_column_(problem.jacobian.topRows(problem.coupled_rows)),
      by_row_(problem.jacobian.topRows(problem.coupled_rows)),
      target_(problem.target.head(problem.coupled_rows)),
      weight_(Eigen::VectorXd::Zero(columns_)),
      pull_(weight_),
      is_wide_(static_cast<std::size_t>(columns_), false) {
  for (Eigen::Index r = rows_; r < problem.jacobian.rows(); ++r) {
    for (decltype(problem.jacobian)::InnerIterator it(problem.jacobian, r); it; ++it) {
      weight_[it.col()] += it.value() * it.value();
      pull_[it.col()] += it.value() * problem.target[r];
    }
  }
  for (std::size_t b = 0; b + 1 < problem.column_blocks.size(); ++b) {
    const int first = problem.column_blocks[b], end = problem.column_blocks[b + 1];
    for (int c = first; end > first + 1 && c < end; ++c) {
      wide_.push_back(c);
      is_wide_[static_cast<std::size_t>(c)] = true;
    }
  }
  find_pattern();
}

void SaddleSystem::find_pattern() {
  const int wide = static_cast<int>(wide_.size()), size = wide + rows_;
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < wide; ++k) {
    entries.emplace_back(k, k, weight_[wide_[static_cast<std::size_t>(k)]]);
    for (Eigen::SparseMatrix<double>::InnerIterator it(by_column_, wide_[static_cast<std::size_t>(k)]); it; ++it) {
      entries.emplace_back(wide + it.row(), k, it.value());
    }
  }
  std::vector<int> seen(static_cast<std::size_t>(rows_), -1);
  for (int r = 0; r < rows_; ++r) {
    entries.emplace_back(wide + r, wide + r, -1);
    seen[static_cast<std::size_t>(r)] = r;
    for (decltype(by_row_)::InnerIterator column(by_row_, r); column; ++column) {
      if (is_wide_[static_cast<std::size_t>(column.col())]) continue;
      for (Eigen::SparseMatrix<double>::InnerIterator it(by_column_, column.col()); it; ++it) {
        int& last = seen[static_cast<std::size_t>(it.row())];
        if (it.row() < r || last == r) continue;
        last = r;
        entries.emplace_back(wide + it.row(), wide + r, 0);
      }
    }
  }
  matrix_.resize(size, size);
  matrix_.setFromTriplets(entries.begin(), entries.end());
  constant_values_ = Eigen::Map<const Eigen::VectorXd>(matrix_.valuePtr(), matrix_.nonZeros());
  place_.assign(static_cast<std::size_t>(size), 0);
  factor_.analyzePattern(matrix_);
}

void SaddleSystem::factor(const std::vector<int>& side, const Eigen::VectorXd& weight) {
  const int wide = static_cast<int>(wide_.size());
  Eigen::Map<Eigen::VectorXd> values(matrix_.valuePtr(), matrix_.nonZeros());
  values = constant_values_;
  for (int r = 0; r < rows_; ++r) {
    for (int k = matrix_.outerIndexPtr()[wide + r]; k < matrix_.outerIndexPtr()[wide + r + 1]; ++k) {
      place_[static_cast<std::size_t>(matrix_.innerIndexPtr()[k])] = k;
    }
    for (decltype(by_row_)::InnerIterator column(by_row_, r); column; ++column) {
      const auto c = static_cast<std::size_t>(column.col());
      if (is_wide_[c] || side[c] != 0) continue;
      const double share = column.value() / weight[column.col()];
      for (Eigen::SparseMatrix<double>::InnerIterator it(by_column_, column.col()); it; ++it) {
        if (it.row() >= r) values[place_[static_cast<std::size_t>(wide + it.row())]] -= share * it.value();
      }
    }
  }
  factor_.factorize(matrix_);
}

void SaddleSystem::solve(const std::vector<int>& side, const Eigen::VectorXd* barrier_weight,
                         const Eigen::VectorXd* barrier_target, Eigen::VectorXd& x) {
  constexpr int kRefinements = 2;
  Eigen::VectorXd weight = weight_, pull = pull_;
  if (barrier_weight != nullptr) {
    weight += *barrier_weight;
    pull += barrier_weight->cwiseProduct(*barrier_target);
  }
  factor(side, weight);
  const Eigen::VectorXd wish = pull.cwiseQuotient(weight);
  const auto wide = static_cast<Eigen::Index>(wide_.size());
  for (Eigen::Index c = 0; c < columns_; ++c) {
    if (side[static_cast<std::size_t>(c)] == 0) x[c] = wish[c];
  }
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(rows_), slope = Eigen::VectorXd::Zero(columns_), error(wide + rows_);
  for (int k = 0; k <= kRefinements; ++k) {
    for (Eigen::Index i = 0; i < wide; ++i) {
      const int c = wide_[static_cast<std::size_t>(i)];
      error[i] = -(weight[c] * (x[c] - wish[c]) + slope[c]);
    }
    error.tail(rows_) = target_ + residual - by_column_ * x;
    const Eigen::VectorXd change = factor_.solve(error);
    residual += change.tail(rows_);
    slope = by_column_.transpose() * residual;
    for (Eigen::Index i = 0; i < wide; ++i) x[wide_[static_cast<std::size_t>(i)]] += change[i];
    for (Eigen::Index c = 0; c < columns_; ++c) {
      const auto column = static_cast<std::size_t>(c);
      if (side[column] == 0 && !is_wide_[column]) x[c] = wish[c] - slope[c] / weight[c];
    }
  }
}

}  // namespace hydrostat::retarget

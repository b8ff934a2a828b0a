#include "physics/system_matrix.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cassert>

#include "physics/elastic_forces.h"

namespace hydrostat::physics {
namespace {

constexpr double kHeld = 1e12;           // times its own stiffness: what a held node resists with
constexpr double kCouplingError = 1e-3;  // of a solution [-], in the norm of the factor
constexpr int kMostIterations = 200;     // of conjugate gradients; as many as couplings have directions, at most

}  // namespace

template <int Dim>
SystemMatrixOf<Dim>::SystemMatrixOf(const BodyOf<Dim>& body) {
  const int nodes = body.node_count(), edges = body.edge_count();
  edge_begin_.assign(static_cast<std::size_t>(nodes) + 1, 0);
  for (int e = 0; e < edges; ++e) {
    assert(body.edges(0, e) < body.edges(1, e));
    ++edge_begin_[static_cast<std::size_t>(body.edges(0, e)) + 1];
    edge_high_.push_back(body.edges(1, e));
  }
  for (int i = 0; i < nodes; ++i) edge_begin_[static_cast<std::size_t>(i) + 1] += edge_begin_[static_cast<std::size_t>(i)];

  matrix_.resize(Dim * nodes, Dim * nodes);
  Eigen::VectorXi per_column(Dim * nodes);
  for (int i = 0; i < nodes; ++i) {
    const int neighbours = edge_begin_[static_cast<std::size_t>(i) + 1] - edge_begin_[static_cast<std::size_t>(i)];
    for (int c = 0; c < Dim; ++c) per_column[Dim * i + c] = Dim - c + Dim * neighbours;
  }
  matrix_.reserve(per_column);
  for (int i = 0; i < nodes; ++i) {
    for (int c = 0; c < Dim; ++c) {
      for (int r = c; r < Dim; ++r) matrix_.insert(Dim * i + r, Dim * i + c) = 0;
      for (int e = edge_begin_[static_cast<std::size_t>(i)]; e < edge_begin_[static_cast<std::size_t>(i) + 1]; ++e) {
        for (int r = 0; r < Dim; ++r) matrix_.insert(Dim * edge_high_[static_cast<std::size_t>(e)] + r, Dim * i + c) = 0;
      }
    }
  }
  matrix_.makeCompressed();
  diagonal_slot_.resize(Dim, nodes);
  edge_slot_.resize(Dim, edges);
  for (int i = 0; i < nodes; ++i) {
    for (int c = 0; c < Dim; ++c) {
      int slot = matrix_.outerIndexPtr()[Dim * i + c];
      diagonal_slot_(c, i) = slot;
      slot += Dim - c;
      for (int e = edge_begin_[static_cast<std::size_t>(i)]; e < edge_begin_[static_cast<std::size_t>(i) + 1];
           ++e, slot += Dim) {
        edge_slot_(c, e) = slot;
      }
    }
  }
  find_factor_pattern(body);
}

template <int Dim>
void SystemMatrixOf<Dim>::find_factor_pattern(const BodyOf<Dim>& body) {
  const int nodes = body.node_count();
  std::vector<Eigen::Triplet<double>> links;
  for (int i = 0; i < nodes; ++i) links.emplace_back(i, i, 1);
  for (int e = 0; e < body.edge_count(); ++e) {
    links.emplace_back(body.edges(0, e), body.edges(1, e), 1);
    links.emplace_back(body.edges(1, e), body.edges(0, e), 1);
  }
  Eigen::SparseMatrix<double> graph(nodes, nodes);
  graph.setFromTriplets(links.begin(), links.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(graph, permutation);
  order_.assign(permutation.indices().begin(), permutation.indices().end());
  std::vector<int> place(order_.size());
  for (int k = 0; k < nodes; ++k) place[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])] = k;

  std::vector<std::vector<Source>> sources(order_.size());
  for (int e = 0; e < body.edge_count(); ++e) {
    const int low = place[static_cast<std::size_t>(body.edges(0, e))],
              high = place[static_cast<std::size_t>(body.edges(1, e))];
    // The matrix holds (high node, low node); work_ wants (column, row), the place in the upper triangle.
    sources[static_cast<std::size_t>(std::max(low, high))].push_back({std::min(low, high), e, low < high});
  }
  // Row k of the factor: what its entries in the matrix reach on their way up the elimination tree.
  std::vector<int> parent(order_.size(), -1), seen(order_.size(), -1);
  std::vector<std::vector<int>> columns_of_row(order_.size());
  std::vector<int> count(order_.size(), 0);
  source_begin_ = entry_begin_ = {0};
  for (int k = 0; k < nodes; ++k) {
    const auto row = static_cast<std::size_t>(k);
    seen[row] = k;
    for (const Source& source : sources[row]) {
      source_.push_back(source);
      for (int i = source.column; seen[static_cast<std::size_t>(i)] != k; i = parent[static_cast<std::size_t>(i)]) {
        if (parent[static_cast<std::size_t>(i)] < 0) parent[static_cast<std::size_t>(i)] = k;
        columns_of_row[row].push_back(i);
        ++count[static_cast<std::size_t>(i)];
        seen[static_cast<std::size_t>(i)] = k;
      }
    }
    std::sort(columns_of_row[row].begin(), columns_of_row[row].end());
    source_begin_.push_back(static_cast<int>(source_.size()));
  }
  column_begin_ = {0};
  for (const int c : count) {
    column_begin_.push_back(column_begin_.back() + c);
    products_to_factor_ += 0.5 * c * (c + 1.0);
  }
  row_.resize(static_cast<std::size_t>(column_begin_.back()));
  std::vector<int> next(column_begin_.begin(), column_begin_.end() - 1);
  for (int k = 0; k < nodes; ++k) {
    for (const int i : columns_of_row[static_cast<std::size_t>(k)]) {
      const int slot = next[static_cast<std::size_t>(i)]++;
      row_[static_cast<std::size_t>(slot)] = k;
      entry_.push_back({i, slot});
    }
    entry_begin_.push_back(static_cast<int>(entry_.size()));
  }
  l_.resize(row_.size());
  d_inverse_.resize(order_.size());
  work_.assign(order_.size(), BlockOf<Dim>::Zero());
}

template <int Dim>
void SystemMatrixOf<Dim>::set_zero() {
  std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
  couplings_.clear();
}

template <int Dim>
void SystemMatrixOf<Dim>::add_diagonal(int node, const BlockOf<Dim>& block) {
  double* const values = matrix_.valuePtr();
  for (int c = 0; c < Dim; ++c) {
    for (int r = c; r < Dim; ++r) values[diagonal_slot_(c, node) + r - c] += block(r, c);
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::add_off_diagonal(int edge, const BlockOf<Dim>& block) {
  double* const values = matrix_.valuePtr();
  for (int c = 0; c < Dim; ++c) {
    for (int r = 0; r < Dim; ++r) values[edge_slot_(c, edge) + r] += block(r, c);
  }
}

template <int Dim>
int SystemMatrixOf<Dim>::edge_between(int low, int high) const {
  const auto begin = edge_high_.begin() + edge_begin_[static_cast<std::size_t>(low)];
  const auto end = edge_high_.begin() + edge_begin_[static_cast<std::size_t>(low) + 1];
  const auto at = std::lower_bound(begin, end, high);
  return at == end || *at != high ? -1 : static_cast<int>(at - edge_high_.begin());
}

template <int Dim>
void SystemMatrixOf<Dim>::add_mass(const BodyOf<Dim>& body, double factor) {
  double* const values = matrix_.valuePtr();
  for (int i = 0; i < body.node_count(); ++i) {
    for (int c = 0; c < Dim; ++c) values[diagonal_slot_(c, i)] += factor * body.mass[i];
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::add_stiffness(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x,
                                        const Eigen::VectorXd& activation, double factor) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = x.col(j) - x.col(i);
    const double length = span.norm();
    if (length == 0) continue;
    const VectorOf<Dim> n = span / length;
    const double across = std::max(0.0, 1 - activation[e] * body.rest_length[e] / length);
    const double k = factor * body.edge_stiffness[e];
    BlockOf<Dim> block = (k * (1 - across)) * n * n.transpose();
    block.diagonal().array() += k * across;
    add_diagonal(i, block);
    add_diagonal(j, block);
    add_off_diagonal(e, -block);
  }
  for (int t = 0; t < body.volume_stiffness.size(); ++t) {
    double jacobian;
    const Eigen::Matrix<double, Dim, Dim + 1> g = jacobian_gradient<Dim>(x, body.tets, t, body.rest_volume[t], jacobian);
    const double k = factor * body.volume_stiffness[t];
    for (int a = 0; a <= Dim; ++a) add_diagonal(body.tets(a, t), k * g.col(a) * g.col(a).transpose());
    int edge = 0;
    for (int a = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b, ++edge) {
        const bool in_order = body.tets(a, t) < body.tets(b, t);  // the block stands at (higher, lower)
        const VectorOf<Dim> high = g.col(in_order ? b : a), low = g.col(in_order ? a : b);
        add_off_diagonal(body.tet_edges(edge, t), k * high * low.transpose());
      }
    }
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::add_element(const ElementBlock<Dim>& block, int element, const Eigen::MatrixXi& edges,
                                      const ElementMatrix& stiffness, double factor) {
  for (int a = 0, pair = 0; a < block.nodes_per_element(); ++a) {
    const int node_a = block.nodes(a, element);
    add_diagonal(node_a, factor * stiffness.block<Dim, Dim>(Dim * a, Dim * a));
    for (int b = a + 1; b < block.nodes_per_element(); ++b, ++pair) {
      const int node_b = block.nodes(b, element);
      const auto [high, low] = node_a < node_b ? std::pair(b, a) : std::pair(a, b);  // of the block that the matrix keeps
      add_off_diagonal(edges(pair, element), factor * stiffness.block<Dim, Dim>(Dim * high, Dim * low));
    }
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::hold(const std::vector<int>& nodes) {
  double* const values = matrix_.valuePtr();
  for (const int node : nodes) {
    for (int c = 0; c < Dim; ++c) values[diagonal_slot_(c, node)] *= kHeld;
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::add_damping(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, double factor) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = x.col(j) - x.col(i);
    const double length_squared = span.squaredNorm();
    if (length_squared == 0) continue;
    const BlockOf<Dim> block = (factor * body.edge_damping[e] / length_squared) * span * span.transpose();
    add_diagonal(i, block);
    add_diagonal(j, block);
    add_off_diagonal(e, -block);
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::add_contact(const ContactPointsOf<Dim>& points, int p, const BlockOf<Dim>& block) {
  add_contact(Dim + 1, points.nodes.col(p).data(), points.weights.col(p).data(), block);
}

template <int Dim>
void SystemMatrixOf<Dim>::add_contact(int count, const int* nodes, const double* weights, const BlockOf<Dim>& block) {
  for (int a = 0; a < count; ++a) {
    if (weights[a] == 0) continue;
    add_diagonal(nodes[a], (weights[a] * weights[a]) * block);
    for (int b = a + 1; b < count; ++b) {
      const double weight = weights[a] * weights[b];
      if (weight == 0) continue;
      const auto [low, high] = std::minmax(nodes[a], nodes[b]);
      const int edge = edge_between(low, high);
      if (edge >= 0) {
        add_off_diagonal(edge, weight * block);
      } else {
        add_diagonal(low, weight * block);
        add_diagonal(high, weight * block);
      }
    }
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::add_coupling(int count, const int* nodes, const double* weights, const BlockOf<Dim>& block) {
  couplings_.emplace_back();
  Coupling& coupling = couplings_.back();
  assert(count <= static_cast<int>(coupling.nodes.size()));
  coupling.count = count;
  std::copy_n(nodes, count, coupling.nodes.begin());
  std::copy_n(weights, count, coupling.weights.begin());
  coupling.block = block;
}

template <int Dim>
bool SystemMatrixOf<Dim>::factor() {
  const double* const values = matrix_.valuePtr();
  for (std::size_t k = 0; k < order_.size(); ++k) {
    for (int s = source_begin_[k]; s < source_begin_[k + 1]; ++s) {
      const Source& source = source_[static_cast<std::size_t>(s)];
      BlockOf<Dim>& block = work_[static_cast<std::size_t>(source.column)];
      for (int c = 0; c < Dim; ++c) block.col(c) = VectorOf<Dim>::Map(values + edge_slot_(c, source.edge));
      if (source.transposed) block.transposeInPlace();
    }
    BlockOf<Dim> diagonal;
    for (int c = 0; c < Dim; ++c) {
      for (int r = c; r < Dim; ++r) diagonal(r, c) = diagonal(c, r) = values[diagonal_slot_(c, order_[k]) + r - c];
    }
    for (int n = entry_begin_[k]; n < entry_begin_[k + 1]; ++n) {
      const auto [column, slot] = entry_[static_cast<std::size_t>(n)];
      BlockOf<Dim>& block = work_[static_cast<std::size_t>(column)];
      const BlockOf<Dim> upper = block;
      block.setZero();
      for (int p = column_begin_[static_cast<std::size_t>(column)]; p < slot; ++p) {
        work_[static_cast<std::size_t>(row_[static_cast<std::size_t>(p)])].noalias() -=
            l_[static_cast<std::size_t>(p)] * upper;
      }
      BlockOf<Dim>& l = l_[static_cast<std::size_t>(slot)];
      l.noalias() = upper.transpose() * d_inverse_[static_cast<std::size_t>(column)];
      diagonal.noalias() -= l * upper;
    }
    const Eigen::LLT<BlockOf<Dim>> cholesky(diagonal);
    if (cholesky.info() != Eigen::Success) {
      std::fill(work_.begin(), work_.end(), BlockOf<Dim>::Zero());
      return false;
    }
    d_inverse_[k] = cholesky.solve(BlockOf<Dim>::Identity());
  }
  return true;
}

template <int Dim>
void SystemMatrixOf<Dim>::solve_in_place(Eigen::Ref<Eigen::MatrixXd> columns) const {
  if (couplings_.empty()) return solve_by_factor(columns);
  for (Eigen::Index c = 0; c < columns.cols(); ++c) solve_with_couplings(columns.col(c));
}

/// The whole matrix, couplings and all, times x.
template <int Dim>
void SystemMatrixOf<Dim>::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const {
  product.setZero();
  for (Eigen::Index c = 0; c < matrix_.cols(); ++c) {
    for (typename Eigen::SparseMatrix<double>::InnerIterator entry(matrix_, c); entry; ++entry) {
      product[entry.row()] += entry.value() * x[c];
      if (entry.row() != c) product[c] += entry.value() * x[entry.row()];
    }
  }
  for (const Coupling& coupling : couplings_) {
    VectorOf<Dim> sum = VectorOf<Dim>::Zero();
    for (int k = 0; k < coupling.count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      sum += coupling.weights[n] * x.template segment<Dim>(Dim * coupling.nodes[n]);
    }
    const VectorOf<Dim> force = coupling.block * sum;
    for (int k = 0; k < coupling.count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      product.template segment<Dim>(Dim * coupling.nodes[n]) += coupling.weights[n] * force;
    }
  }
}

/// Every iterate from zero on is a direction of descent. Source: Nocedal, Wright, "Numerical optimization", 2006, algorithm 5.3.
template <int Dim>
void SystemMatrixOf<Dim>::solve_with_couplings(Eigen::Ref<Eigen::VectorXd> column) const {
  residual_ = column;
  column.setZero();
  preconditioned_.resize(column.size(), 1);
  product_.resize(column.size());
  preconditioned_.col(0) = residual_;
  solve_by_factor(preconditioned_);
  search_ = preconditioned_.col(0);
  double along = residual_.dot(search_);
  const double enough = kCouplingError * kCouplingError * along;
  for (int k = 0; k < kMostIterations && along > enough; ++k) {
    multiply(search_, product_);
    const double step = along / search_.dot(product_);
    column += step * search_;
    residual_ -= step * product_;
    preconditioned_.col(0) = residual_;
    solve_by_factor(preconditioned_);
    const double next = residual_.dot(preconditioned_.col(0));
    search_ = preconditioned_.col(0) + (next / along) * search_;
    along = next;
  }
}

template <int Dim>
void SystemMatrixOf<Dim>::solve_by_factor(Eigen::Ref<Eigen::MatrixXd> columns) const {
  // Forward and back substitution with all right-hand sides of a row beside each other: one pass over L serves them all.
  const auto nodes = static_cast<Eigen::Index>(order_.size());
  scratch_.resize(columns.rows(), columns.cols());
  const auto rows_of = [this](Eigen::Index k) { return scratch_.template middleRows<Dim>(Dim * k); };
  for (Eigen::Index k = 0; k < nodes; ++k)
    rows_of(k) = columns.template middleRows<Dim>(Dim * order_[static_cast<std::size_t>(k)]);
  for (Eigen::Index k = 0; k < nodes; ++k) {
    for (int p = column_begin_[static_cast<std::size_t>(k)]; p < column_begin_[static_cast<std::size_t>(k) + 1]; ++p) {
      rows_of(row_[static_cast<std::size_t>(p)]) -= l_[static_cast<std::size_t>(p)].lazyProduct(rows_of(k));
    }
  }
  for (Eigen::Index k = nodes - 1; k >= 0; --k) {
    for (Eigen::Index c = 0; c < scratch_.cols(); ++c) {
      const VectorOf<Dim> column = d_inverse_[static_cast<std::size_t>(k)] * rows_of(k).col(c);
      rows_of(k).col(c) = column;
    }
    for (int p = column_begin_[static_cast<std::size_t>(k)]; p < column_begin_[static_cast<std::size_t>(k) + 1]; ++p) {
      rows_of(k) -= l_[static_cast<std::size_t>(p)].transpose().lazyProduct(rows_of(row_[static_cast<std::size_t>(p)]));
    }
  }
  for (Eigen::Index k = 0; k < nodes; ++k)
    columns.template middleRows<Dim>(Dim * order_[static_cast<std::size_t>(k)]) = rows_of(k);
}

template class SystemMatrixOf<2>;
template class SystemMatrixOf<3>;

}  // namespace hydrostat::physics

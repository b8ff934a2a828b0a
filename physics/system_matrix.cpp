#include "physics/system_matrix.h"

#include <algorithm>
#include <cassert>

#include "physics/elastic_forces.h"

namespace hydrostat::physics {

SystemMatrix::SystemMatrix(const Body& body) {
  const int nodes = body.node_count(), edges = body.edge_count();
  edge_begin_.assign(static_cast<std::size_t>(nodes) + 1, 0);
  for (int e = 0; e < edges; ++e) {
    assert(body.edges(0, e) < body.edges(1, e));
    ++edge_begin_[static_cast<std::size_t>(body.edges(0, e)) + 1];
    edge_high_.push_back(body.edges(1, e));
  }
  for (int i = 0; i < nodes; ++i) edge_begin_[static_cast<std::size_t>(i) + 1] += edge_begin_[static_cast<std::size_t>(i)];

  matrix_.resize(3 * nodes, 3 * nodes);
  Eigen::VectorXi per_column(3 * nodes);
  for (int i = 0; i < nodes; ++i) {
    const int neighbours = edge_begin_[static_cast<std::size_t>(i) + 1] - edge_begin_[static_cast<std::size_t>(i)];
    for (int c = 0; c < 3; ++c) per_column[3 * i + c] = 3 - c + 3 * neighbours;
  }
  matrix_.reserve(per_column);
  for (int i = 0; i < nodes; ++i) {
    for (int c = 0; c < 3; ++c) {
      for (int r = c; r < 3; ++r) matrix_.insert(3 * i + r, 3 * i + c) = 0;
      for (int e = edge_begin_[static_cast<std::size_t>(i)]; e < edge_begin_[static_cast<std::size_t>(i) + 1]; ++e) {
        for (int r = 0; r < 3; ++r) matrix_.insert(3 * edge_high_[static_cast<std::size_t>(e)] + r, 3 * i + c) = 0;
      }
    }
  }
  matrix_.makeCompressed();
  diagonal_slot_.resize(3, nodes);
  edge_slot_.resize(3, edges);
  for (int i = 0; i < nodes; ++i) {
    for (int c = 0; c < 3; ++c) {
      int slot = matrix_.outerIndexPtr()[3 * i + c];
      diagonal_slot_(c, i) = slot;
      slot += 3 - c;
      for (int e = edge_begin_[static_cast<std::size_t>(i)]; e < edge_begin_[static_cast<std::size_t>(i) + 1];
           ++e, slot += 3) {
        edge_slot_(c, e) = slot;
      }
    }
  }
  factor_.analyzePattern(matrix_);
}

void SystemMatrix::set_zero() { std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0); }

void SystemMatrix::add_diagonal(int node, const Eigen::Matrix3d& block) {
  double* const values = matrix_.valuePtr();
  for (int c = 0; c < 3; ++c) {
    for (int r = c; r < 3; ++r) values[diagonal_slot_(c, node) + r - c] += block(r, c);
  }
}

void SystemMatrix::add_off_diagonal(int edge, const Eigen::Matrix3d& block) {
  double* const values = matrix_.valuePtr();
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) values[edge_slot_(c, edge) + r] += block(r, c);
  }
}

int SystemMatrix::edge_between(int low, int high) const {
  const auto begin = edge_high_.begin() + edge_begin_[static_cast<std::size_t>(low)];
  const auto end = edge_high_.begin() + edge_begin_[static_cast<std::size_t>(low) + 1];
  return static_cast<int>(std::lower_bound(begin, end, high) - edge_high_.begin());
}

void SystemMatrix::add_mass(const Body& body, double factor) {
  double* const values = matrix_.valuePtr();
  for (int i = 0; i < body.node_count(); ++i) {
    for (int c = 0; c < 3; ++c) values[diagonal_slot_(c, i)] += factor * body.mass[i];
  }
}

void SystemMatrix::add_stiffness(const Body& body, const ConstPoints& x, const Eigen::VectorXd& activation, double factor) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const Eigen::Vector3d span = x.col(j) - x.col(i);
    const double length = span.norm();
    if (length == 0) continue;
    const Eigen::Vector3d n = span / length;
    const double across = std::max(0.0, 1 - activation[e] * body.rest_length[e] / length);
    const double k = factor * body.edge_stiffness[e];
    Eigen::Matrix3d block = (k * (1 - across)) * n * n.transpose();
    block.diagonal().array() += k * across;
    add_diagonal(i, block);
    add_diagonal(j, block);
    add_off_diagonal(e, -block);
  }
  for (int t = 0; t < body.tet_count(); ++t) {
    double jacobian;
    const Eigen::Matrix<double, 3, 4> g = jacobian_gradient(x, body.tets, t, body.rest_volume[t], jacobian);
    const double k = factor * body.volume_stiffness[t];
    for (int a = 0; a < 4; ++a) add_diagonal(body.tets(a, t), k * g.col(a) * g.col(a).transpose());
    int edge = 0;
    for (int a = 0; a < 4; ++a) {
      for (int b = a + 1; b < 4; ++b, ++edge) {
        const bool in_order = body.tets(a, t) < body.tets(b, t);  // the block stands at (higher, lower)
        const Eigen::Vector3d high = g.col(in_order ? b : a), low = g.col(in_order ? a : b);
        add_off_diagonal(body.tet_edges(edge, t), k * high * low.transpose());
      }
    }
  }
}

void SystemMatrix::add_damping(const Body& body, const ConstPoints& x, double factor) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const Eigen::Vector3d span = x.col(j) - x.col(i);
    const double length_squared = span.squaredNorm();
    if (length_squared == 0) continue;
    const Eigen::Matrix3d block = (factor * body.edge_damping[e] / length_squared) * span * span.transpose();
    add_diagonal(i, block);
    add_diagonal(j, block);
    add_off_diagonal(e, -block);
  }
}

void SystemMatrix::add_contact(const ContactPoints& points, int p, const Eigen::Matrix3d& block) {
  for (int a = 0; a < 4; ++a) {
    const int i = points.nodes(a, p);
    const double wa = points.weights(a, p);
    if (wa == 0) continue;
    add_diagonal(i, (wa * wa) * block);
    for (int b = a + 1; b < 4; ++b) {
      const double weight = wa * points.weights(b, p);
      if (weight == 0) continue;
      const auto [low, high] = std::minmax(i, points.nodes(b, p));
      add_off_diagonal(edge_between(low, high), weight * block);
    }
  }
}

bool SystemMatrix::factor() {
  factor_.factorize(matrix_);
  return factor_.info() == Eigen::Success && factor_.vectorD().minCoeff() > 0;
}

void SystemMatrix::solve_in_place(Eigen::Ref<Eigen::MatrixXd> columns) const {
  // Forward and back substitution with all right-hand sides of a row beside each other: one pass over L serves them all.
  const Eigen::Index rows = columns.rows(), count = columns.cols();
  const auto& permutation = factor_.permutationP().indices();
  const Eigen::SparseMatrix<double>& l = factor_.matrixL().nestedExpression();
  scratch_.resize(rows, count);
  for (Eigen::Index r = 0; r < rows; ++r) scratch_.row(permutation[r]) = columns.row(r);
  for (Eigen::Index c = 0; c < rows; ++c) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(l, c); it; ++it) {
      if (it.row() > c) scratch_.row(it.row()).noalias() -= it.value() * scratch_.row(c);
    }
  }
  for (Eigen::Index c = rows - 1; c >= 0; --c) {
    scratch_.row(c) /= factor_.vectorD()[c];
    for (Eigen::SparseMatrix<double>::InnerIterator it(l, c); it; ++it) {
      if (it.row() > c) scratch_.row(c).noalias() -= it.value() * scratch_.row(it.row());
    }
  }
  for (Eigen::Index r = 0; r < rows; ++r) columns.row(r) = scratch_.row(permutation[r]);
}

}  // namespace hydrostat::physics

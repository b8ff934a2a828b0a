#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "physics/contact.h"

namespace hydrostat::physics {

/// A symmetric 3N x 3N matrix with one 3 x 3 block per node and per edge of a body, kept in place between assemblies;
/// only the lower triangle is stored. Every term of an implicit step fits it: edges, tets, contact points inside tets.
class SystemMatrix {
 public:
  explicit SystemMatrix(const Body& body);

  void set_zero();
  void add_mass(const Body& body, double factor);
  /// Adds factor * K(x, activation), the positive semi-definite part of the elastic Hessian: an edge under compression
  /// loses its buckling term, a tet keeps kappa V grad J grad J^T.
  void add_stiffness(const Body& body, const ConstPoints& x, const Eigen::VectorXd& activation, double factor);
  /// Adds factor * D(x), the dashpots' matrix.
  void add_damping(const Body& body, const ConstPoints& x, double factor);
  /// Adds w_i w_j * block for the nodes i, j of contact point p; block is symmetric.
  void add_contact(const ContactPoints& points, int p, const Eigen::Matrix3d& block);

  /// Factors the matrix into block L D L^T, up-looking, on the pattern that the constructor found; nothing is allocated.
  /// False: not positive definite.
  /// Source: Davis, "Direct Methods for Sparse Linear Systems", SIAM 2006, chapter 4.
  bool factor();
  /// x <- A^-1 x for each column; allocates only when the number of columns changes.
  void solve_in_place(Eigen::Ref<Eigen::MatrixXd> columns) const;
  const Eigen::SparseMatrix<double>& lower() const { return matrix_; }
  Eigen::Index size() const { return matrix_.rows(); }

 private:
  void find_factor_pattern(const Body& body);
  void add_off_diagonal(int edge, const Eigen::Matrix3d& block);
  void add_diagonal(int node, const Eigen::Matrix3d& block);
  int edge_between(int low, int high) const;

  Eigen::SparseMatrix<double> matrix_;
  Eigen::Matrix3Xi diagonal_slot_;  // 3 x N: where rows c.. of column 3 i + c begin
  Eigen::Matrix3Xi edge_slot_;      // 3 x E: where the block's column c begins
  std::vector<int> edge_begin_;     // N + 1: the edges whose lower node is i (edges are in lexicographic order)
  std::vector<int> edge_high_;      // E

  // The factor: node order_[k] stands at place k, of column k the rows row_[column_begin_[k]] ... below the diagonal are
  // filled.
  struct Entry {  // block of row k of the factor
    int column, slot;
  };
  struct Source {  // block of row k of the matrix, left of the diagonal
    int column, edge;
    bool transposed;
  };
  std::vector<int> order_, column_begin_, row_, entry_begin_, source_begin_;
  std::vector<Entry> entry_;    // by rows, columns ascending
  std::vector<Source> source_;  // by rows
  std::vector<Eigen::Matrix3d> l_, d_inverse_, work_;
  mutable Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> scratch_;
};

}  // namespace hydrostat::physics

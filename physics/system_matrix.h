#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "physics/contact.h"
#include "physics/element_stiffness.h"

namespace hydrostat::physics {

/// A symmetric Dim N x Dim N matrix with one Dim x Dim block per node and per edge of a body, kept in place between
/// assemblies; only the lower triangle is stored. Every term of an implicit step fits it: edges, tets, contact points inside
/// tets.
template <int Dim>
class SystemMatrixOf {
 public:
  explicit SystemMatrixOf(const BodyOf<Dim>& body);

  void set_zero();
  void add_mass(const BodyOf<Dim>& body, double factor);
  /// Adds factor * K(x, activation), the positive semi-definite part of the elastic Hessian: an edge under compression
  /// loses its buckling term, a tet keeps kappa V grad J grad J^T.
  void add_stiffness(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const Eigen::VectorXd& activation, double factor);
  /// Adds factor * stiffness, of an element of a block; `edges` as ActivationFit::of_element.
  void add_element(const ElementBlock<Dim>& block, int element, const Eigen::MatrixXi& edges, const ElementMatrix& stiffness,
                   double factor);
  /// Makes the nodes so heavy that solutions leave them where they are: to be called after all that adds.
  void hold(const std::vector<int>& nodes);
  /// Adds factor * D(x), the dashpots' matrix.
  void add_damping(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, double factor);
  /// Adds w_i w_j * block for the nodes i, j of contact point p; block is symmetric.
  void add_contact(const ContactPointsOf<Dim>& points, int p, const BlockOf<Dim>& block);
  /// The same for `count` nodes and weights >= 0. What couples two nodes without an edge has no place in the matrix and goes
  /// to their diagonals, which makes the matrix larger, never less positive.
  void add_contact(int count, const int* nodes, const double* weights, const BlockOf<Dim>& block);
  /// The same for weights of any sign and nodes without edges between them, as of two parts of the body that touch: it is kept
  /// beside the factor, and solutions are found by conjugate gradients on top of that. At most twelve nodes.
  void add_coupling(int count, const int* nodes, const double* weights, const BlockOf<Dim>& block);

  /// Factors the matrix into block L D L^T, up-looking, on the pattern that the constructor found; nothing is allocated.
  /// False: not positive definite.
  /// Source: Davis, "Direct Methods for Sparse Linear Systems", SIAM 2006, chapter 4.
  bool factor();
  /// x <- A^-1 x for each column; allocates only when the number of columns changes. With couplings to kCouplingError.
  void solve_in_place(Eigen::Ref<Eigen::MatrixXd> columns) const;
  /// Products of blocks that factor and solve_in_place (of one column) take.
  double products_to_factor() const { return products_to_factor_; }
  double products_to_solve() const { return 2.0 * static_cast<double>(row_.size()) + static_cast<double>(order_.size()); }
  const Eigen::SparseMatrix<double>& lower() const { return matrix_; }
  Eigen::Index size() const { return matrix_.rows(); }

 private:
  void find_factor_pattern(const BodyOf<Dim>& body);
  void add_off_diagonal(int edge, const BlockOf<Dim>& block);
  void add_diagonal(int node, const BlockOf<Dim>& block);
  void solve_by_factor(Eigen::Ref<Eigen::MatrixXd> columns) const;
  void solve_with_couplings(Eigen::Ref<Eigen::VectorXd> column) const;
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const;
  int edge_between(int low, int high) const;  // -1 for none

  Eigen::SparseMatrix<double> matrix_;
  Eigen::Matrix<int, Dim, Eigen::Dynamic> diagonal_slot_;  // Dim x N: where rows c.. of column Dim i + c begin
  Eigen::Matrix<int, Dim, Eigen::Dynamic> edge_slot_;      // Dim x E: where the block's column c begins
  std::vector<int> edge_begin_;  // N + 1: the edges whose lower node is i (edges are in lexicographic order)
  std::vector<int> edge_high_;   // E

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
  double products_to_factor_ = 0;
  std::vector<BlockOf<Dim>> l_, d_inverse_, work_;
  mutable Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> scratch_;

  struct Coupling {
    int count;
    std::array<int, 12> nodes;
    std::array<double, 12> weights;
    BlockOf<Dim> block;
  };
  std::vector<Coupling> couplings_;
  mutable Eigen::VectorXd residual_, search_, product_;  // of the conjugate gradients
  mutable Eigen::MatrixXd preconditioned_;
};
using SystemMatrix = SystemMatrixOf<3>;

}  // namespace hydrostat::physics

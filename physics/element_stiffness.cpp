#include "physics/element_stiffness.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "physics/element_variation.h"

namespace hydrostat::physics {
namespace {

template <int Dim, int Nodes>
ElementMatrix stiffness_of(const ElementVariation<Dim, Nodes>& variation, Definiteness definiteness) {
  using Variation = ElementVariation<Dim, Nodes>;
  constexpr int kPlaces = Variation::kVariables / Dim;
  const typename Variation::Weights weights = variation.node_weights();
  const typename Variation::Hessian hessian = variation.hessian(definiteness);
  // Variable Dim p + i moves with component i of node n by weights(n, p).
  Eigen::Matrix<double, Variation::kVariables, Dim * Nodes> half = Eigen::Matrix<double, Variation::kVariables, Dim * Nodes>::Zero();
  for (int n = 0; n < Nodes; ++n) {
    for (int p = 0; p < kPlaces; ++p) half.template middleCols<Dim>(Dim * n) += weights(n, p) * hessian.template middleCols<Dim>(Dim * p);
  }
  ElementMatrix result = ElementMatrix::Zero(Dim * Nodes, Dim * Nodes);
  for (int n = 0; n < Nodes; ++n) {
    for (int p = 0; p < kPlaces; ++p) result.middleRows<Dim>(Dim * n) += weights(n, p) * half.template middleRows<Dim>(Dim * p);
  }
  return result;
}

template <int Dim>
double determinant_of_edges(const NodeMatrix<Dim>& corners, int corner, bool is_box) {
  SquareMatrix<double, Dim> edges;
  for (int d = 0; d < Dim; ++d) {
    edges.col(d) = is_box ? (corners.col(corner | 1 << d) - corners.col(corner & ~(1 << d))).eval()
                          : (corners.col(d + 1) - corners.col(0)).eval();
  }
  return edges.determinant();
}

}  // namespace

template <int Dim>
ElementMatrix element_stiffness(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x,
                                const ActiveStrain<Dim>* active, Definiteness definiteness) {
  if (block.is_box()) return stiffness_of(ElementVariation<Dim, 1 << Dim>(block, element, x, active), definiteness);
  return stiffness_of(ElementVariation<Dim, Dim + 1>(block, element, x, active), definiteness);
}

template <int Dim>
double highest_frequency(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active) {
  double highest_squared = 0;
  for (int e = 0; e < block.element_count(); ++e) {
    ElementMatrix matrix = element_stiffness(block, e, x, active, Definiteness::kExact);
    for (int a = 0; a < block.nodes_per_element(); ++a) {
      for (int b = 0; b < block.nodes_per_element(); ++b) {
        matrix.block<Dim, Dim>(Dim * a, Dim * b) /= std::sqrt(block.nodal_mass(a, e) * block.nodal_mass(b, e));
      }
    }
    const Eigen::SelfAdjointEigenSolver<ElementMatrix> modes(matrix, Eigen::EigenvaluesOnly);
    highest_squared = std::max(highest_squared, modes.eigenvalues().maxCoeff());
  }
  return std::sqrt(highest_squared);
}

template <int Dim>
Eigen::VectorXd least_jacobians(const ElementBlock<Dim>& block, const ElementMesh<Dim>& mesh, const ConstNodeMatrix<Dim>& x) {
  Eigen::VectorXd least(block.element_count());
  NodeMatrix<Dim> now(Dim, block.nodes_per_element());
  for (int e = 0; e < block.element_count(); ++e) {
    const NodeMatrix<Dim> rest = corners_of<Dim>(mesh, e);
    for (int n = 0; n < block.nodes_per_element(); ++n) now.col(n) = x.col(block.nodes(n, e));
    least[e] = std::numeric_limits<double>::infinity();
    for (int corner = 0; corner < (block.is_box() ? 1 << Dim : 1); ++corner) {
      const double ratio = determinant_of_edges<Dim>(now, corner, block.is_box()) / determinant_of_edges<Dim>(rest, corner, block.is_box());
      least[e] = std::min(least[e], ratio);
    }
  }
  return least;
}

template ElementMatrix element_stiffness<2>(const ElementBlock<2>&, int, const ConstNodeMatrix<2>&, const ActiveStrain<2>*,
                                            Definiteness);
template ElementMatrix element_stiffness<3>(const ElementBlock<3>&, int, const ConstNodeMatrix<3>&, const ActiveStrain<3>*,
                                            Definiteness);
template double highest_frequency<2>(const ElementBlock<2>&, const ConstNodeMatrix<2>&, const ActiveStrain<2>*);
template double highest_frequency<3>(const ElementBlock<3>&, const ConstNodeMatrix<3>&, const ActiveStrain<3>*);
template Eigen::VectorXd least_jacobians<2>(const ElementBlock<2>&, const ElementMesh<2>&, const ConstNodeMatrix<2>&);
template Eigen::VectorXd least_jacobians<3>(const ElementBlock<3>&, const ElementMesh<3>&, const ConstNodeMatrix<3>&);

}  // namespace hydrostat::physics

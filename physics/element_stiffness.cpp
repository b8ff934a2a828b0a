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

constexpr double kSlack = 1.5;  // the bound is less tight at rest than where it grows

/// Bound on the second derivative of the law at F: what |F| and its cofactor add to shear and pressure.
template <int Dim>
double stiffness_bound(ElasticLaw law, const Lame& lame, const SquareMatrix<double, Dim>& F) {
  if (law == ElasticLaw::kCorotatedLinear) {  // grows where much is stretched and two sides are not
    const double stretch = std::sqrt(F.squaredNorm() / Dim);
    return 2 * lame.mu + Dim * lame.lambda * std::max(1.0, stretch);
  }
  const StableNeoHookean<double> flesh(lame.lambda, lame.mu);
  const SquareMatrix<double, Dim> slope = cofactor(F);
  const double squared = F.squaredNorm(), invariant = squared + 4 - Dim;
  return flesh.mu * (1 - 1 / invariant + 2 * squared / (invariant * invariant)) + flesh.lambda * slope.squaredNorm() +
         std::abs(flesh.pressure(determinant(F, slope))) * (Dim == 3 ? std::sqrt(squared) : 1);
}

template <int Dim, int Nodes>
double stiffening_of(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active) {
  using Kernel = ElementKernel<double, Dim, Nodes>;
  using Layout = ElementLayout<Dim, Nodes>;
  double growth = 1;
  for (int e = 0; e < block.element_count(); ++e) {
    const ElementData<double> data(block.lanes, e, Layout::kSize);
    SquareMatrix<double, Dim> F = SquareMatrix<double, Dim>::Zero();
    for (int n = 1; n < Nodes; ++n) {
      const Eigen::Matrix<double, Dim, 1> offset = x.col(block.nodes(n, e)) - x.col(block.nodes(0, e));
      for (int j = 0; j < Dim; ++j) F.col(j) += data[Layout::kGradient + Dim * (n - 1) + j] * offset;
    }
    double of_gradients = 1;
    if (active) {
      const SquareMatrix<double, Dim> inverse =
          Kernel::active_inverse(ElementData<double>(active->lanes, e, ActiveLayout<Dim, Nodes>::kSize));
      F = (F * inverse).eval();
      const double longest = inverse.cwiseAbs().rowwise().sum().maxCoeff();  // no eigenvalue is larger
      of_gradients = std::max(1.0, longest * longest);
    }
    const Lame lame{data[Layout::kLambda], data[Layout::kMu]};
    const SquareMatrix<double, Dim> rest = SquareMatrix<double, Dim>::Identity();
    const double ratio = stiffness_bound<Dim>(block.law, lame, F) / stiffness_bound<Dim>(block.law, lame, rest);
    growth = std::max(growth, of_gradients * (1 + kSlack * (ratio - 1)));
  }
  return growth;
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
double element_stiffening(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active) {
  return block.is_box() ? stiffening_of<Dim, 1 << Dim>(block, x, active) : stiffening_of<Dim, Dim + 1>(block, x, active);
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
template double element_stiffening<2>(const ElementBlock<2>&, const ConstNodeMatrix<2>&, const ActiveStrain<2>*);
template double element_stiffening<3>(const ElementBlock<3>&, const ConstNodeMatrix<3>&, const ActiveStrain<3>*);
template Eigen::VectorXd least_jacobians<2>(const ElementBlock<2>&, const ElementMesh<2>&, const ConstNodeMatrix<2>&);
template Eigen::VectorXd least_jacobians<3>(const ElementBlock<3>&, const ElementMesh<3>&, const ConstNodeMatrix<3>&);

}  // namespace hydrostat::physics

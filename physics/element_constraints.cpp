#include "physics/element_constraints.h"

#include <algorithm>
#include <array>

namespace hydrostat::physics {

ElementConstraints make_element_constraints(const Eigen::MatrixXi& element_nodes) {
  const int corners = static_cast<int>(element_nodes.rows()), pairs = corners * (corners - 1) / 2;
  struct Use {
    std::array<int, 2> pair;
    int element, place;
  };
  std::vector<Use> uses;
  uses.reserve(static_cast<std::size_t>(pairs * element_nodes.cols()));
  for (int e = 0; e < element_nodes.cols(); ++e) {
    int place = 0;
    for (int a = 0; a < corners; ++a) {
      for (int b = a + 1; b < corners; ++b) {
        const auto [low, high] = std::minmax({element_nodes(a, e), element_nodes(b, e)});
        uses.push_back({{low, high}, e, place++});
      }
    }
  }
  std::stable_sort(uses.begin(), uses.end(), [](const Use& one, const Use& other) { return one.pair < other.pair; });

  ElementConstraints constraints;
  constraints.of_element.resize(pairs, element_nodes.cols());
  constraints.nodes.resize(2, static_cast<Eigen::Index>(uses.size()));
  int count = 0;
  for (std::size_t u = 0; u < uses.size(); ++u) {
    if (u == 0 || uses[u].pair != uses[u - 1].pair) constraints.nodes.col(count++) << uses[u].pair[0], uses[u].pair[1];
    constraints.of_element(uses[u].place, uses[u].element) = count - 1;
  }
  constraints.nodes.conservativeResize(2, count);
  return constraints;
}

template <int Dim>
ConstraintSprings make_constraint_springs(const ElementMesh<Dim>& mesh, const ElementBlock<Dim>& block,
                                          const ElementConstraints& constraints, double share) {
  // A uniform stretch e of all springs costs sum(k l0^2) e^2 / 2; of Cauchy's solid in 3D 6 E V e^2 / 2, in 2D 3.2 E V e^2 / 2.
  constexpr double kSwelling = Dim == 3 ? 6 : 3.2;
  ConstraintSprings springs;
  springs.nodes = constraints.nodes;
  springs.rest_length.resize(constraints.count());
  springs.stiffness = Eigen::VectorXd::Zero(constraints.count());
  for (int c = 0; c < constraints.count(); ++c) {
    springs.rest_length[c] = (mesh.rest.col(springs.nodes(1, c)) - mesh.rest.col(springs.nodes(0, c))).norm();
  }
  const Eigen::Index pairs = constraints.of_element.rows();
  for (int e = 0; e < block.element_count(); ++e) {
    const ElementMaterial& material = mesh.materials[mesh.materials.size() == 1 ? 0 : e];
    const double energy = kSwelling * share * material.youngs_modulus * block.rest_volume[e] * mesh.fill[e] / pairs;
    for (int p = 0; p < pairs; ++p) {
      const int c = constraints.of_element(p, e);
      springs.stiffness[c] += energy / (springs.rest_length[c] * springs.rest_length[c]);
    }
  }
  return springs;
}

template <int Dim>
double spring_energy(const ConstraintSprings& springs, const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
  double energy = 0;
  for (int c = 0; c < springs.nodes.cols(); ++c) {
    const double length = (x.col(springs.nodes(1, c)) - x.col(springs.nodes(0, c))).norm();
    const double stretch = length - activation[c] * springs.rest_length[c];
    energy += 0.5 * springs.stiffness[c] * stretch * stretch;
  }
  return energy;
}

template <int Dim>
void add_spring_forces(const ConstraintSprings& springs, const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation,
                       NodeMatrix<Dim>& force) {
  for (int c = 0; c < springs.nodes.cols(); ++c) {
    const int low = springs.nodes(0, c), high = springs.nodes(1, c);
    const Eigen::Matrix<double, Dim, 1> span = x.col(high) - x.col(low);
    const double length = span.norm();
    if (length == 0) continue;
    const double tension = springs.stiffness[c] * (length - activation[c] * springs.rest_length[c]);
    const Eigen::Matrix<double, Dim, 1> pull = (tension / length) * span;
    force.col(low) += pull;
    force.col(high) -= pull;
  }
}

template <int Dim>
NodeMatrix<Dim> spring_force_per_activation(const ConstraintSprings& springs, const ConstNodeMatrix<Dim>& x) {
  NodeMatrix<Dim> slope = NodeMatrix<Dim>::Zero(Dim, springs.nodes.cols());
  for (int c = 0; c < springs.nodes.cols(); ++c) {
    const Eigen::Matrix<double, Dim, 1> span = x.col(springs.nodes(1, c)) - x.col(springs.nodes(0, c));
    const double length = span.norm();
    if (length > 0) slope.col(c) = (springs.stiffness[c] * springs.rest_length[c] / length) * span;
  }
  return slope;
}

template ConstraintSprings make_constraint_springs<2>(const ElementMesh<2>&, const ElementBlock<2>&,
                                                       const ElementConstraints&, double);
template ConstraintSprings make_constraint_springs<3>(const ElementMesh<3>&, const ElementBlock<3>&,
                                                       const ElementConstraints&, double);
template double spring_energy<2>(const ConstraintSprings&, const ConstNodeMatrix<2>&, const Eigen::VectorXd&);
template double spring_energy<3>(const ConstraintSprings&, const ConstNodeMatrix<3>&, const Eigen::VectorXd&);
template void add_spring_forces<2>(const ConstraintSprings&, const ConstNodeMatrix<2>&, const Eigen::VectorXd&, NodeMatrix<2>&);
template void add_spring_forces<3>(const ConstraintSprings&, const ConstNodeMatrix<3>&, const Eigen::VectorXd&, NodeMatrix<3>&);
template NodeMatrix<2> spring_force_per_activation<2>(const ConstraintSprings&, const ConstNodeMatrix<2>&);
template NodeMatrix<3> spring_force_per_activation<3>(const ConstraintSprings&, const ConstNodeMatrix<3>&);

}  // namespace hydrostat::physics

#include "physics/element_body.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <numeric>

namespace hydrostat::physics {
namespace {

/// The corners of the tets of a box, one for each order of the axes along which to walk from its first corner to its last.
template <int Dim>
Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> tets_of_box() {
  std::array<int, Dim> axes;
  std::iota(axes.begin(), axes.end(), 0);
  Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> tets(Dim + 1, Dim == 3 ? 6 : 2);
  int tet = 0;
  do {
    BlockOf<Dim> turn = BlockOf<Dim>::Zero();
    tets(0, tet) = 0;
    for (int k = 0; k < Dim; ++k) {
      const int axis = axes[static_cast<std::size_t>(k)];
      tets(k + 1, tet) = tets(k, tet) | 1 << axis;
      turn(axis, k) = 1;
    }
    if (turn.determinant() < 0) std::swap(tets(Dim - 1, tet), tets(Dim, tet));
    ++tet;
  } while (std::next_permutation(axes.begin(), axes.end()));
  return tets;
}

template <int Dim>
void fill_with_tets(const ElementMesh<Dim>& mesh, bool is_box, BodyOf<Dim>& body) {
  if (!is_box) {
    body.tets = mesh.nodes;
  } else {
    const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> parts = tets_of_box<Dim>();
    body.tets.resize(Dim + 1, parts.cols() * mesh.nodes.cols());
    for (Eigen::Index e = 0; e < mesh.nodes.cols(); ++e) {
      for (Eigen::Index p = 0; p < parts.cols(); ++p) {
        for (int k = 0; k <= Dim; ++k) body.tets(k, parts.cols() * e + p) = mesh.nodes(parts(k, p), e);
      }
    }
  }
  body.rest_volume = Eigen::VectorXd::Ones(body.tets.cols());
  body.rest_volume = jacobians(body, body.rest);  // of unit volumes
  assert(body.rest_volume.minCoeff() > 0);
}

/// The edge between two nodes; `edges` are in lexicographic order.
int edge_between(const Eigen::Matrix2Xi& edges, int a, int b) {
  const auto [low, high] = std::minmax(a, b);
  Eigen::Index first = 0, end = edges.cols();
  while (first < end) {
    const Eigen::Index middle = (first + end) / 2;
    const bool is_before = edges(0, middle) < low || (edges(0, middle) == low && edges(1, middle) < high);
    (is_before ? first : end) = is_before ? middle + 1 : middle;
  }
  assert(edges(0, first) == low && edges(1, first) == high);
  return static_cast<int>(first);
}

}  // namespace

template <int Dim>
BodyOf<Dim> make_body(const ElementMesh<Dim>& mesh, const ElementBodyOptions& options) {
  BodyOf<Dim> body;
  body.rest = mesh.rest;
  BodyElements<Dim> elements;
  elements.block = make_element_block(mesh, options.law);
  const ElementConstraints constraints = make_element_constraints(mesh.nodes);
  elements.fit = make_activation_fit(mesh, constraints);
  body.mass = Eigen::VectorXd::Zero(mesh.rest.cols());
  add_lumped_mass(elements.block, body.mass);
  body.edges = constraints.nodes;
  const ConstraintSprings springs = make_constraint_springs(mesh, elements.block, constraints, 1);
  body.rest_length = springs.rest_length;
  body.edge_stiffness = options.spring_share * springs.stiffness;
  body.edge_damping = options.damping_time * springs.stiffness;
  fill_with_tets(mesh, elements.block.is_box(), body);
  body.tet_edges.resize(kEdgesPerTet<Dim>, body.tets.cols());
  for (Eigen::Index t = 0; t < body.tets.cols(); ++t) {
    for (int a = 0, k = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b, ++k) body.tet_edges(k, t) = edge_between(body.edges, body.tets(a, t), body.tets(b, t));
    }
  }
  body.elements.push_back(std::move(elements));
  return body;
}

template BodyOf<2> make_body<2>(const ElementMesh<2>&, const ElementBodyOptions&);
template BodyOf<3> make_body<3>(const ElementMesh<3>&, const ElementBodyOptions&);

}  // namespace hydrostat::physics

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
Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> tets_of(const ElementMesh<Dim>& mesh) {
  if (mesh.nodes.rows() == Dim + 1) return mesh.nodes;
  const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> parts = tets_of_box<Dim>();
  Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> tets(Dim + 1, parts.cols() * mesh.nodes.cols());
  for (Eigen::Index e = 0; e < mesh.nodes.cols(); ++e) {
    for (Eigen::Index p = 0; p < parts.cols(); ++p) {
      for (int k = 0; k <= Dim; ++k) tets(k, parts.cols() * e + p) = mesh.nodes(parts(k, p), e);
    }
  }
  return tets;
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
BodyElements<Dim> make_body_elements(const ElementMesh<Dim>& mesh, ElasticLaw law) {
  return {make_element_block(mesh, law), make_activation_fit(mesh, make_element_constraints(mesh.nodes)), mesh.materials,
          mesh.fill};
}

template <int Dim>
ElementMesh<Dim> mesh_of(const BodyOf<Dim>& body, const BodyElements<Dim>& elements) {
  return {body.rest, elements.block.nodes, elements.materials, elements.fill};
}

template <int Dim>
BodyOf<Dim> make_body(const ElementMesh<Dim>& mesh, const ElementBodyOptions& options) {
  return make_body<Dim>(mesh, tets_of(mesh), options);
}

template <int Dim>
BodyOf<Dim> make_body(const ElementMesh<Dim>& mesh, const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic>& tets,
                      const ElementBodyOptions& options) {
  BodyOf<Dim> body;
  body.rest = mesh.rest;
  BodyElements<Dim> elements = make_body_elements(mesh, options.law);
  const ElementConstraints constraints = make_element_constraints(mesh.nodes);
  body.mass = Eigen::VectorXd::Zero(mesh.rest.cols());
  add_lumped_mass(elements.block, body.mass);
  body.edges = constraints.nodes;
  const ConstraintSprings springs = make_constraint_springs(mesh, elements.block, constraints, 1);
  body.rest_length = springs.rest_length;
  body.edge_stiffness = options.spring_share * springs.stiffness;
  body.edge_damping = options.damping_time * springs.stiffness;
  body.tets = tets;
  body.rest_volume = Eigen::VectorXd::Ones(tets.cols());
  body.rest_volume = jacobians(body, body.rest);  // of unit volumes
  assert(body.rest_volume.minCoeff() > 0);
  body.tet_edges.resize(kEdgesPerTet<Dim>, body.tets.cols());
  for (Eigen::Index t = 0; t < body.tets.cols(); ++t) {
    for (int a = 0, k = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b, ++k) body.tet_edges(k, t) = edge_between(body.edges, body.tets(a, t), body.tets(b, t));
    }
  }
  body.elements.push_back(std::move(elements));
  return body;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                 \
  template BodyElements<Dim> make_body_elements<Dim>(const ElementMesh<Dim>&, ElasticLaw);                         \
  template ElementMesh<Dim> mesh_of<Dim>(const BodyOf<Dim>&, const BodyElements<Dim>&);                            \
  template BodyOf<Dim> make_body<Dim>(const ElementMesh<Dim>&, const ElementBodyOptions&);                         \
  template BodyOf<Dim> make_body<Dim>(const ElementMesh<Dim>&, const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic>&, \
                                      const ElementBodyOptions&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics

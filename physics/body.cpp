#include "physics/body.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <map>
#include <utility>

#include "physics/face_key.h"

namespace hydrostat::physics {
namespace {

template <int Dim>
double tet_volume(const ConstPointsOf<Dim>& x, const Eigen::Matrix<int, Dim + 1, 1>& tet) {
  const VectorOf<Dim> a = x.col(tet[1]) - x.col(tet[0]);
  const VectorOf<Dim> b = x.col(tet[2]) - x.col(tet[0]);
  if constexpr (Dim == 3) {
    const VectorOf<Dim> c = x.col(tet[3]) - x.col(tet[0]);
    return a.dot(b.cross(c)) / kSimplexFactor<Dim>;
  } else {
    return cross<Dim>(a, b)[0] / kSimplexFactor<Dim>;
  }
}

}  // namespace

template <int Dim>
BodyOf<Dim> make_body(const PointsOf<Dim>& rest, const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic>& tets,
                      const Eigen::Matrix2Xi& edges, const Eigen::VectorXd& fill, const Material& material) {
  constexpr int kEdges = kEdgesPerTet<Dim>;
  BodyOf<Dim> body;
  body.rest = rest;
  body.tets = tets;
  body.edges = edges;
  body.mass = Eigen::VectorXd::Zero(rest.cols());
  body.rest_volume.resize(tets.cols());
  body.volume_stiffness.resize(tets.cols());
  body.tet_edges.resize(kEdges, tets.cols());
  body.rest_length.resize(edges.cols());
  std::map<std::pair<int, int>, int> edge_of;
  for (int e = 0; e < edges.cols(); ++e) {
    edge_of[{edges(0, e), edges(1, e)}] = e;
    body.rest_length[e] = (rest.col(edges(1, e)) - rest.col(edges(0, e))).norm();
  }
  Eigen::VectorXd edge_volume = Eigen::VectorXd::Zero(edges.cols());
  for (int t = 0; t < tets.cols(); ++t) {
    const double volume = tet_volume<Dim>(rest, tets.col(t));
    assert(volume > 0);
    const double filled = volume * fill[t];
    body.rest_volume[t] = volume;
    body.volume_stiffness[t] = material.bulk_factor * material.youngs_modulus * filled;
    for (int k = 0; k <= Dim; ++k) body.mass[tets(k, t)] += material.density * filled / (Dim + 1);
    for (int a = 0, k = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b, ++k) {
        const auto [low, high] = std::minmax(tets(a, t), tets(b, t));
        const int e = edge_of.at({low, high});
        body.tet_edges(k, t) = e;
        edge_volume[e] += filled / kEdges;
      }
    }
  }
  body.edge_stiffness = kEdges * material.youngs_modulus * edge_volume.array() / body.rest_length.array().square();
  body.edge_damping = material.damping_time * body.edge_stiffness;
  return body;
}

template <int Dim>
std::vector<SurfaceFace> surface_faces(const BodyOf<Dim>& body) {
  std::map<std::array<int, Dim>, SurfaceFace> face_of;  // by key_of_face; tet -1: two tets share it
  for (int t = 0; t < body.tet_count(); ++t) {
    for (int opposite = 0; opposite <= Dim; ++opposite) {
      const SurfaceFace face{t, opposite};
      const auto [entry, is_new] = face_of.try_emplace(key_of_face(body, face), face);
      if (!is_new) entry->second.tet = -1;
    }
  }
  std::vector<SurfaceFace> faces;
  for (const auto& [key, face] : face_of) {
    if (face.tet >= 0) faces.push_back(face);
  }
  return faces;
}

template <int Dim>
Eigen::Matrix<int, Dim, 1> nodes_of_face(const BodyOf<Dim>& body, const SurfaceFace& face) {
  // The other nodes of a tet run around the outside as they stand or, if an odd one is missing, the other way.
  Eigen::Matrix<int, Dim, 1> nodes;
  for (int k = 0, n = 0; k <= Dim; ++k) {
    if (k != face.opposite) nodes[n++] = body.tets(k, face.tet);
  }
  if (face.opposite % 2 == 1) std::swap(nodes[0], nodes[1]);
  return nodes;
}

template <int Dim>
Eigen::VectorXd inverse_masses(const BodyOf<Dim>& body) {
  Eigen::VectorXd inverse = body.mass.cwiseInverse();
  for (const int node : body.held) inverse[node] = 0;
  return inverse;
}

template <int Dim>
VectorOf<Dim> centre_of_mass(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x) {
  return x * body.mass / body.mass.sum();
}

template <int Dim>
VectorOf<Dim> momentum(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& v) {
  return v * body.mass;
}

template <int Dim>
SpinOf<Dim> angular_momentum(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const ConstPointsOf<Dim>& v,
                             const std::type_identity_t<VectorOf<Dim>>& about) {
  SpinOf<Dim> sum = SpinOf<Dim>::Zero();
  for (int i = 0; i < body.node_count(); ++i) {
    const VectorOf<Dim> arm = x.col(i) - about, momentum_of_node = body.mass[i] * v.col(i);
    sum += cross<Dim>(arm, momentum_of_node);
  }
  return sum;
}

template <int Dim>
InertiaOf<Dim> inertia(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x,
                       const std::type_identity_t<VectorOf<Dim>>& about) {
  InertiaOf<Dim> sum = InertiaOf<Dim>::Zero();
  for (int i = 0; i < body.node_count(); ++i) {
    const VectorOf<Dim> arm = x.col(i) - about;
    if constexpr (Dim == 3) {
      sum += body.mass[i] * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
    } else {
      sum(0, 0) += body.mass[i] * arm.squaredNorm();
    }
  }
  return sum;
}

template <int Dim>
double volume(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x) {
  double sum = 0;
  for (int t = 0; t < body.tet_count(); ++t) sum += tet_volume<Dim>(x, body.tets.col(t));
  return sum;
}

template <int Dim>
Eigen::VectorXd jacobians(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x) {
  Eigen::VectorXd jacobian(body.tet_count());
  for (int t = 0; t < body.tet_count(); ++t) jacobian[t] = tet_volume<Dim>(x, body.tets.col(t)) / body.rest_volume[t];
  return jacobian;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                     \
  template BodyOf<Dim> make_body<Dim>(const Eigen::Matrix<double, Dim, Eigen::Dynamic>&,                               \
                                      const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic>&, const Eigen::Matrix2Xi&,     \
                                      const Eigen::VectorXd&, const Material&);                                        \
  template std::vector<SurfaceFace> surface_faces<Dim>(const BodyOf<Dim>&);                                            \
  template Eigen::Matrix<int, Dim, 1> nodes_of_face<Dim>(const BodyOf<Dim>&, const SurfaceFace&);                      \
  template Eigen::VectorXd inverse_masses<Dim>(const BodyOf<Dim>&);                                                    \
  template VectorOf<Dim> centre_of_mass<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&);                           \
  template VectorOf<Dim> momentum<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&);                                 \
  template SpinOf<Dim> angular_momentum<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&, const ConstPointsOf<Dim>&, \
                                             const std::type_identity_t<VectorOf<Dim>>&);                              \
  template InertiaOf<Dim> inertia<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&,                                  \
                                       const std::type_identity_t<VectorOf<Dim>>&);                                    \
  template double volume<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&);                                          \
  template Eigen::VectorXd jacobians<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics

#include "physics/body.h"

#include <Eigen/Geometry>
#include <cassert>
#include <map>
#include <utility>

namespace hydrostat::physics {
namespace {

constexpr int kTetEdge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

double tet_volume(const ConstPoints& x, const Eigen::Vector4i& tet) {
  const Eigen::Vector3d a = x.col(tet[1]) - x.col(tet[0]);
  const Eigen::Vector3d b = x.col(tet[2]) - x.col(tet[0]);
  const Eigen::Vector3d c = x.col(tet[3]) - x.col(tet[0]);
  return a.dot(b.cross(c)) / 6;
}

}  // namespace

Body make_body(const Eigen::Matrix3Xd& rest, const Eigen::Matrix4Xi& tets, const Eigen::Matrix2Xi& edges,
               const Eigen::VectorXd& fill, const Material& material) {
  Body body;
  body.rest = rest;
  body.tets = tets;
  body.edges = edges;
  body.mass = Eigen::VectorXd::Zero(rest.cols());
  body.rest_volume.resize(tets.cols());
  body.volume_stiffness.resize(tets.cols());
  body.tet_edges.resize(6, tets.cols());
  body.rest_length.resize(edges.cols());
  std::map<std::pair<int, int>, int> edge_of;
  for (int e = 0; e < edges.cols(); ++e) {
    edge_of[{edges(0, e), edges(1, e)}] = e;
    body.rest_length[e] = (rest.col(edges(1, e)) - rest.col(edges(0, e))).norm();
  }
  Eigen::VectorXd edge_volume = Eigen::VectorXd::Zero(edges.cols());
  for (int t = 0; t < tets.cols(); ++t) {
    const double volume = tet_volume(rest, tets.col(t));
    assert(volume > 0);
    const double filled = volume * fill[t];
    body.rest_volume[t] = volume;
    body.volume_stiffness[t] = material.bulk_factor * material.youngs_modulus * filled;
    for (int k = 0; k < 4; ++k) body.mass[tets(k, t)] += material.density * filled / 4;
    for (int k = 0; k < 6; ++k) {
      const auto [low, high] = std::minmax(tets(kTetEdge[k][0], t), tets(kTetEdge[k][1], t));
      const int e = edge_of.at({low, high});
      body.tet_edges(k, t) = e;
      edge_volume[e] += filled / 6;
    }
  }
  body.edge_stiffness = 6 * material.youngs_modulus * edge_volume.array() / body.rest_length.array().square();
  body.edge_damping = material.damping_time * body.edge_stiffness;
  return body;
}

Eigen::Vector3d centre_of_mass(const Body& body, const ConstPoints& x) { return x * body.mass / body.mass.sum(); }

Eigen::Vector3d momentum(const Body& body, const ConstPoints& v) { return v * body.mass; }

Eigen::Vector3d angular_momentum(const Body& body, const ConstPoints& x, const ConstPoints& v,
                                 const Eigen::Vector3d& about) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < body.node_count(); ++i) {
    const Eigen::Vector3d arm = x.col(i) - about, momentum_of_node = body.mass[i] * v.col(i);
    sum += arm.cross(momentum_of_node);
  }
  return sum;
}

Eigen::Matrix3d inertia(const Body& body, const ConstPoints& x, const Eigen::Vector3d& about) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int i = 0; i < body.node_count(); ++i) {
    const Eigen::Vector3d arm = x.col(i) - about;
    sum += body.mass[i] * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
  }
  return sum;
}

double volume(const Body& body, const ConstPoints& x) {
  double sum = 0;
  for (int t = 0; t < body.tet_count(); ++t) sum += tet_volume(x, body.tets.col(t));
  return sum;
}

Eigen::VectorXd jacobians(const Body& body, const ConstPoints& x) {
  Eigen::VectorXd jacobian(body.tet_count());
  for (int t = 0; t < body.tet_count(); ++t) jacobian[t] = tet_volume(x, body.tets.col(t)) / body.rest_volume[t];
  return jacobian;
}

}  // namespace hydrostat::physics

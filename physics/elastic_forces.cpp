#include "physics/elastic_forces.h"

namespace hydrostat::physics {
namespace {

void add_volume_forces(const Body& body, const ConstPoints& x, Eigen::Matrix3Xd& force) {
  for (int t = 0; t < body.tet_count(); ++t) {
    double jacobian;
    const Eigen::Matrix<double, 3, 4> gradient = jacobian_gradient(x, body.tets, t, body.rest_volume[t], jacobian);
    const double pressure = body.volume_stiffness[t] * (1 - jacobian);
    for (int k = 0; k < 4; ++k) force.col(body.tets(k, t)) += pressure * gradient.col(k);
  }
}

}  // namespace

double elastic_energy(const Body& body, const ConstPoints& x, const Eigen::VectorXd& activation) {
  double energy = 0;
  for (int e = 0; e < body.edge_count(); ++e) {
    const double stretch = (x.col(body.edges(1, e)) - x.col(body.edges(0, e))).norm() - activation[e] * body.rest_length[e];
    energy += 0.5 * body.edge_stiffness[e] * stretch * stretch;
  }
  for (int t = 0; t < body.tet_count(); ++t) {
    double jacobian;
    jacobian_gradient(x, body.tets, t, body.rest_volume[t], jacobian);
    energy += 0.5 * body.volume_stiffness[t] * (jacobian - 1) * (jacobian - 1);
  }
  return energy;
}

void add_elastic_forces(const Body& body, const ConstPoints& x, const Eigen::VectorXd& activation, Eigen::Matrix3Xd& force) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const Eigen::Vector3d span = x.col(j) - x.col(i);
    const double length = span.norm();
    if (length == 0) continue;  // no direction
    const Eigen::Vector3d pull = (body.edge_stiffness[e] * (length - activation[e] * body.rest_length[e]) / length) * span;
    force.col(i) += pull;
    force.col(j) -= pull;
  }
  add_volume_forces(body, x, force);
}

void add_damping_forces(const Body& body, const ConstPoints& x, const ConstPoints& v, Eigen::Matrix3Xd& force) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const Eigen::Vector3d span = x.col(j) - x.col(i);
    const double length_squared = span.squaredNorm();
    if (length_squared == 0) continue;
    const Eigen::Vector3d pull = (body.edge_damping[e] * (v.col(j) - v.col(i)).dot(span) / length_squared) * span;
    force.col(i) += pull;
    force.col(j) -= pull;
  }
}

void add_internal_forces(const Body& body, const State& state, const Eigen::VectorXd& activation, Eigen::Matrix3Xd& force) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const Eigen::Vector3d span = state.x.col(j) - state.x.col(i);
    const double length_squared = span.squaredNorm();
    if (length_squared == 0) continue;
    const double rate = (state.v.col(j) - state.v.col(i)).dot(span) / length_squared;
    const double spring = body.edge_stiffness[e] * (1 - activation[e] * body.rest_length[e] / std::sqrt(length_squared));
    const Eigen::Vector3d pull = (spring + body.edge_damping[e] * rate) * span;
    force.col(i) += pull;
    force.col(j) -= pull;
  }
  add_volume_forces(body, state.x, force);
}

}  // namespace hydrostat::physics

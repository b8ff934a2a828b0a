#pragma once

#include "physics/body.h"

namespace hydrostat::physics {

/// Elastic energy [J]: sum over edges of k/2 (l - a l0)^2 and over tets of kappa V/2 (J - 1)^2; a is the activation, E.
double elastic_energy(const Body& body, const ConstPoints& x, const Eigen::VectorXd& activation);

/// Adds minus the gradient of elastic_energy to `force` [N] 3 x N.
void add_elastic_forces(const Body& body, const ConstPoints& x, const Eigen::VectorXd& activation, Eigen::Matrix3Xd& force);

/// Adds the axial dashpots' forces to `force` [N] 3 x N: they brake stretch rates alone, never a rigid motion.
void add_damping_forces(const Body& body, const ConstPoints& x, const ConstPoints& v, Eigen::Matrix3Xd& force);

/// Elastic forces and dashpots in one pass over the edges, as the explicit step wants them.
void add_internal_forces(const Body& body, const State& state, const Eigen::VectorXd& activation, Eigen::Matrix3Xd& force);

/// Gradients of J of a tet [1/m] with respect to its four nodes, as columns, for corners a b c from node 0.
inline Eigen::Matrix<double, 3, 4> jacobian_gradient(const ConstPoints& x, const Eigen::Matrix4Xi& tets, int t,
                                                     double rest_volume, double& jacobian);

}  // namespace hydrostat::physics

#include <Eigen/Geometry>

namespace hydrostat::physics {

inline Eigen::Matrix<double, 3, 4> jacobian_gradient(const ConstPoints& x, const Eigen::Matrix4Xi& tets, int t,
                                                     double rest_volume, double& jacobian) {
  const Eigen::Vector3d a = x.col(tets(1, t)) - x.col(tets(0, t));
  const Eigen::Vector3d b = x.col(tets(2, t)) - x.col(tets(0, t));
  const Eigen::Vector3d c = x.col(tets(3, t)) - x.col(tets(0, t));
  const double scale = 1 / (6 * rest_volume);
  Eigen::Matrix<double, 3, 4> gradient;
  gradient.col(1) = b.cross(c) * scale;
  gradient.col(2) = c.cross(a) * scale;
  gradient.col(3) = a.cross(b) * scale;
  gradient.col(0) = -(gradient.col(1) + gradient.col(2) + gradient.col(3));
  jacobian = a.dot(gradient.col(1));
  return gradient;
}

}  // namespace hydrostat::physics

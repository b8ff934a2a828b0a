#pragma once

#include "physics/body.h"

namespace hydrostat::physics {

// What edges and tets do; a body's finite elements come to it in InternalForces.

/// Elastic energy [J]: sum over edges of k/2 (l - a l0)^2 and over tets of kappa V/2 (J - 1)^2; a is the activation, E.
template <int Dim>
double elastic_energy(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const Eigen::VectorXd& activation);

/// Adds minus the gradient of elastic_energy to `force` [N] Dim x N.
template <int Dim>
void add_elastic_forces(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const Eigen::VectorXd& activation,
                        PointsOf<Dim>& force);

/// Adds the axial dashpots' forces to `force` [N] Dim x N: they brake stretch rates alone, never a rigid motion.
template <int Dim>
void add_damping_forces(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const ConstPointsOf<Dim>& v,
                        PointsOf<Dim>& force);

/// Half of what the dashpots of edges that lie as in `x` take times the time [J s] while the nodes go from `from` to `to`: over
/// that time the potential of their forces with respect to `to`.
template <int Dim>
double damping_potential(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const ConstPointsOf<Dim>& from,
                    const ConstPointsOf<Dim>& to);

/// Elastic forces and dashpots in one pass over the edges, as the explicit step wants them.
template <int Dim>
void add_internal_forces(const BodyOf<Dim>& body, const StateOf<Dim>& state, const Eigen::VectorXd& activation,
                         PointsOf<Dim>& force);

/// Gradients of J of a tet [1/m] with respect to its nodes, as columns; `jacobian` becomes J itself.
template <int Dim>
inline Eigen::Matrix<double, Dim, Dim + 1> jacobian_gradient(const ConstPointsOf<Dim>& x,
                                                             const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic>& tets, int t,
                                                             double rest_volume, double& jacobian) {
  const VectorOf<Dim> a = x.col(tets(1, t)) - x.col(tets(0, t));
  const VectorOf<Dim> b = x.col(tets(2, t)) - x.col(tets(0, t));
  const double scale = 1 / (kSimplexFactor<Dim> * rest_volume);
  Eigen::Matrix<double, Dim, Dim + 1> gradient;
  if constexpr (Dim == 3) {
    const VectorOf<Dim> c = x.col(tets(3, t)) - x.col(tets(0, t));
    gradient.col(1) = b.cross(c) * scale;
    gradient.col(2) = c.cross(a) * scale;
    gradient.col(3) = a.cross(b) * scale;
    gradient.col(0) = -(gradient.col(1) + gradient.col(2) + gradient.col(3));
  } else {
    gradient.col(1) = VectorOf<Dim>(b.y(), -b.x()) * scale;
    gradient.col(2) = VectorOf<Dim>(-a.y(), a.x()) * scale;
    gradient.col(0) = -(gradient.col(1) + gradient.col(2));
  }
  jacobian = a.dot(gradient.col(1));
  return gradient;
}

}  // namespace hydrostat::physics

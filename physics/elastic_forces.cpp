#include "physics/elastic_forces.h"

namespace hydrostat::physics {
namespace {

template <int Dim>
void add_volume_forces(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, PointsOf<Dim>& force) {
  for (int t = 0; t < body.volume_stiffness.size(); ++t) {
    double jacobian;
    const Eigen::Matrix<double, Dim, Dim + 1> gradient =
        jacobian_gradient<Dim>(x, body.tets, t, body.rest_volume[t], jacobian);
    const double pressure = body.volume_stiffness[t] * (1 - jacobian);
    for (int k = 0; k <= Dim; ++k) force.col(body.tets(k, t)) += pressure * gradient.col(k);
  }
}

}  // namespace

template <int Dim>
double elastic_energy(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const Eigen::VectorXd& activation) {
  double energy = 0;
  for (int e = 0; e < body.edge_count(); ++e) {
    const double stretch = (x.col(body.edges(1, e)) - x.col(body.edges(0, e))).norm() - activation[e] * body.rest_length[e];
    energy += 0.5 * body.edge_stiffness[e] * stretch * stretch;
  }
  for (int t = 0; t < body.volume_stiffness.size(); ++t) {
    double jacobian;
    jacobian_gradient<Dim>(x, body.tets, t, body.rest_volume[t], jacobian);
    energy += 0.5 * body.volume_stiffness[t] * (jacobian - 1) * (jacobian - 1);
  }
  return energy;
}

template <int Dim>
void add_elastic_forces(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const Eigen::VectorXd& activation,
                        PointsOf<Dim>& force) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = x.col(j) - x.col(i);
    const double length = span.norm();
    if (length == 0) continue;  // no direction
    const VectorOf<Dim> pull = (body.edge_stiffness[e] * (length - activation[e] * body.rest_length[e]) / length) * span;
    force.col(i) += pull;
    force.col(j) -= pull;
  }
  add_volume_forces(body, x, force);
}

template <int Dim>
double damping_potential(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const ConstPointsOf<Dim>& from,
                    const ConstPointsOf<Dim>& to) {
  double sum = 0;
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = x.col(j) - x.col(i);
    const double length_squared = span.squaredNorm();
    if (length_squared == 0) continue;
    const double along = (to.col(j) - to.col(i) - from.col(j) + from.col(i)).dot(span);
    sum += 0.5 * body.edge_damping[e] * along * along / length_squared;
  }
  return sum;
}

template <int Dim>
void add_damping_forces(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const ConstPointsOf<Dim>& v,
                        PointsOf<Dim>& force) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = x.col(j) - x.col(i);
    const double length_squared = span.squaredNorm();
    if (length_squared == 0) continue;
    const VectorOf<Dim> pull = (body.edge_damping[e] * (v.col(j) - v.col(i)).dot(span) / length_squared) * span;
    force.col(i) += pull;
    force.col(j) -= pull;
  }
}

template <int Dim>
void add_internal_forces(const BodyOf<Dim>& body, const StateOf<Dim>& state, const Eigen::VectorXd& activation,
                         PointsOf<Dim>& force) {
  for (int e = 0; e < body.edge_count(); ++e) {
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = state.x.col(j) - state.x.col(i);
    const double length_squared = span.squaredNorm();
    if (length_squared == 0) continue;
    const double rate = (state.v.col(j) - state.v.col(i)).dot(span) / length_squared;
    const double spring = body.edge_stiffness[e] * (1 - activation[e] * body.rest_length[e] / std::sqrt(length_squared));
    const VectorOf<Dim> pull = (spring + body.edge_damping[e] * rate) * span;
    force.col(i) += pull;
    force.col(j) -= pull;
  }
  add_volume_forces(body, state.x, force);
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                \
  template double elastic_energy<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&, const Eigen::VectorXd&);     \
  template void add_elastic_forces<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&, const Eigen::VectorXd&,    \
                                        PointsOf<Dim>&);                                                          \
  template double damping_potential<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&, const ConstPointsOf<Dim>&,     \
                                    const ConstPointsOf<Dim>&);                                                   \
  template void add_damping_forces<Dim>(const BodyOf<Dim>&, const ConstPointsOf<Dim>&, const ConstPointsOf<Dim>&, \
                                        PointsOf<Dim>&);                                                          \
  template void add_internal_forces<Dim>(const BodyOf<Dim>&, const StateOf<Dim>&, const Eigen::VectorXd&, PointsOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics

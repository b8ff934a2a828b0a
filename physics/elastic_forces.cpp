#include "physics/elastic_forces.h"

#include "physics/elastic_sweep.h"
#include "physics/wide.h"

namespace hydrostat::physics {
namespace {

template <int Dim>
HYDROSTAT_FLATTEN void add_forces(const ElasticSweep<Dim>& sweep) {
  sweep.add_forces();
}

#ifdef HYDROSTAT_WIDE
template <int Dim>
HYDROSTAT_WIDE void add_forces_wide(const ElasticSweep<Dim>& sweep) {
  sweep.add_forces();
}
#endif

template <int Dim>
void add_forces_here(const ElasticSweep<Dim>& sweep) {
#ifdef HYDROSTAT_WIDE
  static const bool is_wide = processor_is_wide();
  if (is_wide) return add_forces_wide(sweep);
#endif
  add_forces(sweep);
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
  add_forces_here(ElasticSweep<Dim>{body, x.data(), nullptr, activation.data(), force.data()});
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
  add_forces_here(ElasticSweep<Dim>{body, x.data(), v.data(), nullptr, force.data()});
}

template <int Dim>
void add_internal_forces(const BodyOf<Dim>& body, const StateOf<Dim>& state, const Eigen::VectorXd& activation,
                         PointsOf<Dim>& force) {
  add_forces_here(ElasticSweep<Dim>{body, state.x.data(), state.v.data(), activation.data(), force.data()});
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

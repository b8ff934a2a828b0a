#include "physics/element_constraint.h"

#include <cmath>

#include "physics/element_kernel.h"

namespace hydrostat::physics {
namespace {

constexpr double kCollapsed = 0.2;  // of the squared norm of a rotation [-]: below, an element has collapsed

template <int Dim, int Nodes>
void evaluate_as(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>& active,
                 ElementConstraint<Dim>& constraint) {
  using Kernel = ElementKernel<double, Dim, Nodes>;
  const ElementData<double> data(block.lanes, element, Kernel::Layout::kSize);
  const ElementData<double> shape(active.lanes, element, Kernel::Active::kSize);
  typename Kernel::Offsets offset;
  for (int n = 1; n < Nodes; ++n) offset.col(n - 1) = x.col(block.nodes(n, element)) - x.col(block.nodes(0, element));
  typename Kernel::Strain strain = Kernel::strain_of(data, offset);
  const typename Kernel::Square inverse = Kernel::active_inverse(shape);
  const typename Kernel::Hourglass rest = Kernel::active_hourglass(shape);
  strain.F = (strain.F * inverse).eval();
  const ElasticLaw law = strain.F.squaredNorm() < kCollapsed * Dim ? ElasticLaw::kCorotatedLinear : block.law;
  constraint.value = std::sqrt(2 * std::max(0.0, Kernel::energy(law, data, rest, strain)));
  constraint.gradient.setZero();
  if (constraint.value == 0) return;
  typename Kernel::Square stress;
  typename Kernel::Hourglass hourglass_force;
  Kernel::differentiate(law, data, rest, strain, stress, hourglass_force);
  stress = (stress * inverse).eval();
  const typename Kernel::Offsets forces = Kernel::nodal_forces(data, stress, hourglass_force);
  for (int n = 1; n < Nodes; ++n) {
    constraint.gradient.col(n) = -forces.col(n - 1) / constraint.value;
    constraint.gradient.col(0) -= constraint.gradient.col(n);
  }
}

template <int Dim, int Nodes>
double modulus_times_volume(const ElementBlock<Dim>& block, int element) {
  using Layout = ElementLayout<Dim, Nodes>;
  const ElementData<double> data(block.lanes, element, Layout::kSize);
  const double lambda = data[Layout::kLambda], mu = data[Layout::kMu];
  return mu * (3 * lambda + 2 * mu) / (lambda + mu);
}

}  // namespace

template <int Dim>
void evaluate(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>& active,
              ElementConstraint<Dim>& constraint) {
  if (block.is_box()) return evaluate_as<Dim, 1 << Dim>(block, element, x, active, constraint);
  evaluate_as<Dim, Dim + 1>(block, element, x, active, constraint);
}

template <int Dim>
double youngs_modulus_times_volume(const ElementBlock<Dim>& block, int element) {
  return block.is_box() ? modulus_times_volume<Dim, 1 << Dim>(block, element) : modulus_times_volume<Dim, Dim + 1>(block, element);
}

template void evaluate<2>(const ElementBlock<2>&, int, const ConstNodeMatrix<2>&, const ActiveStrain<2>&, ElementConstraint<2>&);
template void evaluate<3>(const ElementBlock<3>&, int, const ConstNodeMatrix<3>&, const ActiveStrain<3>&, ElementConstraint<3>&);
template double youngs_modulus_times_volume<2>(const ElementBlock<2>&, int);
template double youngs_modulus_times_volume<3>(const ElementBlock<3>&, int);

}  // namespace hydrostat::physics

#include "physics/element_variation.h"

namespace hydrostat::physics {
namespace {

template <class Variation>
typename Variation::Change unit_change(int variable) {
  constexpr int kOfGradient = Variation::Square::SizeAtCompileTime;
  typename Variation::Change change;
  if (variable < kOfGradient) {
    change.F(variable) = 1;
  } else {
    change.Q(variable - kOfGradient) = 1;
  }
  return change;
}

}  // namespace

template <int Dim, int Nodes>
ElementVariation<Dim, Nodes>::ElementVariation(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x,
                                               const ActiveStrain<Dim>* active)
    : law_(block.law), data_(block.lanes, element, Layout::kSize) {
  if (active) {
    const ElementData<double> shape(active->lanes, element, ActiveLayout<Dim, Nodes>::kSize);
    inverse_ = Kernel::active_inverse(shape);
    rest_ = Kernel::active_hourglass(shape);
  }
  differentiate(block, element, x);
}

template <int Dim, int Nodes>
ElementVariation<Dim, Nodes>::ElementVariation(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x,
                                               const Square& active_inverse, const Hourglass& active_hourglass)
    : law_(block.law), data_(block.lanes, element, Layout::kSize), inverse_(active_inverse), rest_(active_hourglass) {
  differentiate(block, element, x);
}

template <int Dim, int Nodes>
GradientDerivative<Dim> ElementVariation<Dim, Nodes>::moduli(Definiteness definiteness) const {
  return stress_derivative<Dim>(law_, {data_[Layout::kLambda], data_[Layout::kMu]}, F_, definiteness);
}

template <int Dim, int Nodes>
typename ElementVariation<Dim, Nodes>::Weights ElementVariation<Dim, Nodes>::node_weights() const {
  Weights weights;
  for (int n = 1; n < Nodes; ++n) {
    Eigen::Matrix<double, Dim, 1> gradient;
    for (int j = 0; j < Dim; ++j) gradient[j] = data_[Layout::kGradient + Dim * (n - 1) + j];
    weights.row(n).template head<Dim>() = (inverse_ * gradient).transpose();
    for (int k = 0; k < kModes; ++k) weights(n, Dim + k) = data_[Layout::kHourglass + kModes * (n - 1) + k];
  }
  weights.row(0) = -weights.bottomRows(Nodes - 1).colwise().sum();
  return weights;
}

template <int Dim, int Nodes>
typename ElementVariation<Dim, Nodes>::Hessian ElementVariation<Dim, Nodes>::hessian(Definiteness definiteness) const {
  Hessian result = Hessian::Zero();
  if constexpr (kModes > 0) {
    definiteness == Definiteness::kExact ? add_exact_hourglass(result) : add_projected_hourglass(result);
  }
  result.template topLeftCorner<Dim * Dim, Dim * Dim>() += moduli(definiteness);
  return result;
}

template <int Dim, int Nodes>
typename ElementVariation<Dim, Nodes>::Response ElementVariation<Dim, Nodes>::respond(const Change& change) const {
  const Spin<double, Dim> turn = spin_of(change.F);
  const Square spin = skew<double, Dim>(turn);
  const Hourglass dh = turned_.R.transpose() * change.Q - spin * turned_.h;
  const Hourglass dforce = Kernel::stiffness_times(data_, Hourglass(dh - change.rest));
  const Square dU = turned_.R.transpose() * change.F - spin * turned_.U;
  const Spin<double, Dim> dmoment =
      moment_of<double, Dim, kModes>(dh, turned_.force) + moment_of<double, Dim, kModes>(turned_.h, dforce) - softening(dU);
  const Square dspin = skew<double, Dim>(solve_spin<double, Dim>(turned_.U, dmoment));
  return {-turned_.R * (spin * skew<double, Dim>(turned_.spin) + dspin), turned_.R * (spin * turned_.force + dforce)};
}

template <int Dim, int Nodes>
void ElementVariation<Dim, Nodes>::differentiate(const ElementBlock<Dim>& block, int element,
                                                 const ConstNodeMatrix<Dim>& x) {
  typename Kernel::Offsets offset;
  for (int n = 1; n < Nodes; ++n) offset.col(n - 1) = x.col(block.nodes(n, element)) - x.col(block.nodes(0, element));
  typename Kernel::Strain strain = Kernel::strain_of(data_, offset);
  strain.F = (strain.F * inverse_).eval();
  F_ = strain.F;
  if constexpr (kModes > 0) turned_ = Kernel::turn(data_, rest_, strain);
  Hourglass force;
  Kernel::differentiate(law_, data_, rest_, strain, stress_, force);
}

/// How fast the frame turns: the spin of R when F changes by dF.
template <int Dim, int Nodes>
Spin<double, Dim> ElementVariation<Dim, Nodes>::spin_of(const Square& dF) const {
  return solve_spin<double, Dim>(turned_.U, axial_difference<double, Dim>(turned_.R.transpose() * dF));
}

/// (tr dU I - dU) t: what the change of U takes from the moment that the spin t balances.
template <int Dim, int Nodes>
Spin<double, Dim> ElementVariation<Dim, Nodes>::softening(const Square& dU) const {
  if constexpr (Dim == 2) {
    return Spin<double, 2>(dU.trace() * turned_.spin[0]);
  } else {
    return dU.trace() * turned_.spin - dU * turned_.spin;
  }
}

template <int Dim, int Nodes>
void ElementVariation<Dim, Nodes>::add_exact_hourglass(Hessian& hessian) const {
  for (int v = 0; v < kVariables; ++v) {
    const Response response = respond(unit_change<ElementVariation>(v));
    hessian.col(v).template head<Dim * Dim>() += response.stress.reshaped();
    hessian.col(v).template tail<Dim * kModes>() += response.force.reshaped();
  }
}

/// D^T S D, D the derivative of h.
template <int Dim, int Nodes>
void ElementVariation<Dim, Nodes>::add_projected_hourglass(Hessian& hessian) const {
  Eigen::Matrix<double, Dim * kModes, kVariables> D, SD;
  for (int v = 0; v < kVariables; ++v) {
    const Change change = unit_change<ElementVariation>(v);
    const Square spin = skew<double, Dim>(spin_of(change.F));
    const Hourglass dh = turned_.R.transpose() * change.Q - spin * turned_.h;
    D.col(v) = dh.reshaped();
    SD.col(v) = Kernel::stiffness_times(data_, dh).reshaped();
  }
  hessian += D.transpose() * SD;
}

template class ElementVariation<2, 3>;
template class ElementVariation<2, 4>;
template class ElementVariation<3, 4>;
template class ElementVariation<3, 8>;

}  // namespace hydrostat::physics

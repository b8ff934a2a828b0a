#pragma once

#include <utility>

#include "physics/element_kernel.h"

namespace hydrostat::physics {

/// One element at one deformation, and how its stress and hourglass force change with the deformation and with the active
/// shape: the second derivatives of its energy V W(F) + (h - g).S(h - g) / 2, h = R^T Q. Inner part of the element_*.cpp.
template <int Dim, int Nodes>
class ElementVariation {
 public:
  using Kernel = ElementKernel<double, Dim, Nodes>;
  using Layout = ElementLayout<Dim, Nodes>;
  using Square = typename Kernel::Square;
  using Hourglass = typename Kernel::Hourglass;
  static constexpr int kModes = Layout::kModes;
  /// The energy's variables (F, then Q, columns stacked) and what a node contributes to them.
  static constexpr int kVariables = Dim * (Dim + kModes);
  using Hessian = Eigen::Matrix<double, kVariables, kVariables>;
  using Weights = Eigen::Matrix<double, Nodes, Dim + kModes>;
  struct Change {
    Square F = Square::Zero();
    Hourglass Q = Hourglass::Zero();
    Hourglass rest = Hourglass::Zero();  // of the active hourglass coordinates g
  };
  struct Response {
    Square stress;    // of the derivative with respect to F [J]
    Hourglass force;  // of the derivative with respect to Q [N]
  };

  ElementVariation(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active)
      : law_(block.law), data_(block.lanes, element, Layout::kSize) {
    if (active) {
      const ElementData<double> shape(active->lanes, element, ActiveLayout<Dim, Nodes>::kSize);
      inverse_ = Kernel::active_inverse(shape);
      rest_ = Kernel::active_hourglass(shape);
    }
    differentiate(block, element, x);
  }
  /// The active shape given as the inverse of its stretch and its hourglass coordinates.
  ElementVariation(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x, const Square& active_inverse,
                   const Hourglass& active_hourglass)
      : law_(block.law), data_(block.lanes, element, Layout::kSize), inverse_(active_inverse), rest_(active_hourglass) {
    differentiate(block, element, x);
  }

  const Square& F() const { return F_; }
  const Square& stress() const { return stress_; }
  /// In the turned frame [N].
  const Hourglass& hourglass_force() const { return turned_.force; }

  /// Of the law alone, without the hourglass part.
  GradientDerivative<Dim> moduli(Definiteness definiteness) const {
    return stress_derivative<Dim>(law_, {data_[Layout::kLambda], data_[Layout::kMu]}, F_, definiteness);
  }

  /// Row n: what node n adds to F and Q per metre it moves.
  Weights node_weights() const {
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

  Hessian hessian(Definiteness definiteness) const {
    Hessian result = Hessian::Zero();
    if constexpr (kModes > 0) {
      definiteness == Definiteness::kExact ? add_exact_hourglass(result) : add_projected_hourglass(result);
    }
    result.template topLeftCorner<Dim * Dim, Dim * Dim>() += moduli(definiteness);
    return result;
  }

  /// The hourglass part's share of the exact response; dh is the change of h.
  Response respond(const Change& change) const {
    const Spin<double, Dim> turn = spin_of(change.F);
    const Square spin = skew<double, Dim>(turn);
    const Hourglass dh = turned_.R.transpose() * change.Q - spin * turned_.h;
    const Hourglass dforce = Kernel::stiffness_times(data_, Hourglass(dh - change.rest));
    const Square dU = turned_.R.transpose() * change.F - spin * turned_.U;
    const Spin<double, Dim> dmoment = moment_of<double, Dim, kModes>(dh, turned_.force) +
                                      moment_of<double, Dim, kModes>(turned_.h, dforce) - softening(dU);
    const Square dspin = skew<double, Dim>(solve_spin<double, Dim>(turned_.U, dmoment));
    return {-turned_.R * (spin * skew<double, Dim>(turned_.spin) + dspin), turned_.R * (spin * turned_.force + dforce)};
  }

 private:
  void differentiate(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x) {
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
  Spin<double, Dim> spin_of(const Square& dF) const {
    return solve_spin<double, Dim>(turned_.U, axial_difference<double, Dim>(turned_.R.transpose() * dF));
  }

  /// (tr dU I - dU) t: what the change of U takes from the moment that the spin t balances.
  Spin<double, Dim> softening(const Square& dU) const {
    if constexpr (Dim == 2) {
      return Spin<double, 2>(dU.trace() * turned_.spin[0]);
    } else {
      return dU.trace() * turned_.spin - dU * turned_.spin;
    }
  }

  static Change unit_change(int variable) {
    Change change;
    if (variable < Dim * Dim) {
      change.F(variable) = 1;
    } else {
      change.Q(variable - Dim * Dim) = 1;
    }
    return change;
  }

  void add_exact_hourglass(Hessian& hessian) const {
    for (int v = 0; v < kVariables; ++v) {
      const Response response = respond(unit_change(v));
      hessian.col(v).template head<Dim * Dim>() += response.stress.reshaped();
      hessian.col(v).template tail<Dim * kModes>() += response.force.reshaped();
    }
  }

  /// D^T S D, D the derivative of h.
  void add_projected_hourglass(Hessian& hessian) const {
    Eigen::Matrix<double, Dim * kModes, kVariables> D, SD;
    for (int v = 0; v < kVariables; ++v) {
      const Change change = unit_change(v);
      const Square spin = skew<double, Dim>(spin_of(change.F));
      const Hourglass dh = turned_.R.transpose() * change.Q - spin * turned_.h;
      D.col(v) = dh.reshaped();
      SD.col(v) = Kernel::stiffness_times(data_, dh).reshaped();
    }
    hessian += D.transpose() * SD;
  }

  ElasticLaw law_;
  ElementData<double> data_;
  Square inverse_ = Square::Identity();  // of the active stretch
  Hourglass rest_ = Hourglass::Zero();
  Square F_, stress_;
  typename Kernel::Turned turned_;
};

}  // namespace hydrostat::physics

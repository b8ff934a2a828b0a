#pragma once

#include "physics/element_activation.h"
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

  ElementVariation(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x,
                   const ActiveStrain<Dim>* active);
  /// The active shape given as the inverse of its stretch and its hourglass coordinates.
  ElementVariation(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x, const Square& active_inverse,
                   const Hourglass& active_hourglass);

  const Square& F() const { return F_; }
  const Square& stress() const { return stress_; }
  /// In the turned frame [N].
  const Hourglass& hourglass_force() const { return turned_.force; }

  /// Of the law alone, without the hourglass part.
  GradientDerivative<Dim> moduli(Definiteness definiteness) const;

  /// Row n: what node n adds to F and Q per metre it moves.
  Weights node_weights() const;

  Hessian hessian(Definiteness definiteness) const;

  /// The hourglass part's share of the exact response; dh is the change of h.
  Response respond(const Change& change) const;

 private:
  void differentiate(const ElementBlock<Dim>& block, int element, const ConstNodeMatrix<Dim>& x);
  Spin<double, Dim> spin_of(const Square& dF) const;
  Spin<double, Dim> softening(const Square& dU) const;
  void add_exact_hourglass(Hessian& hessian) const;
  void add_projected_hourglass(Hessian& hessian) const;

  ElasticLaw law_;
  ElementData<double> data_;
  Square inverse_ = Square::Identity();  // of the active stretch
  Hourglass rest_ = Hourglass::Zero();
  Square F_, stress_;
  typename Kernel::Turned turned_;
};

}  // namespace hydrostat::physics

#pragma once

#include "physics/element_block.h"
#include "physics/material_rotation.h"
#include "physics/material_stress.h"

namespace hydrostat::physics {

// The mechanics of one element (Scalar is double) or of four at once (Lanes). Inner part of the element_*.cpp.

/// Where the numbers of an element lie in ElementBlock::lanes.
template <int Dim, int Nodes>
struct ElementLayout {
  static constexpr int kModes = Nodes - 1 - Dim;       // hourglass patterns: 0 for simplices
  static constexpr int kCoordinates = Dim * kModes;    // hourglass coordinates
  static constexpr int kVolume = 0;                    // [m3] of matter
  static constexpr int kLambda = 1, kMu = 2;           // [J] Lamé parameters times the volume of matter
  static constexpr int kGradient = 3;                  // [1/m] of nodes 1.. (that of node 0 balances them): node, then axis
  static constexpr int kHourglass = kGradient + Dim * (Nodes - 1);      // [-] of nodes 1..: node, then pattern
  static constexpr int kStiffness = kHourglass + kModes * (Nodes - 1);  // [N/m] lower triangle by rows
  static constexpr int kSize = kStiffness + kCoordinates * (kCoordinates + 1) / 2;
};
/// Where the numbers of an element lie in ActiveStrain::lanes.
template <int Dim, int Nodes>
struct ActiveLayout {
  static constexpr int kInverse = 0;               // [-] of the active stretch, symmetric: row, then column
  static constexpr int kHourglass = Dim * Dim;     // [m] hourglass coordinates of the active shape: pattern, then axis
  static constexpr int kSize = kHourglass + ElementLayout<Dim, Nodes>::kCoordinates;
};

/// The numbers of one element, or of a batch of four, in an array of lanes.
template <class Scalar>
class ElementData;
template <>
class ElementData<Lanes> {
 public:
  ElementData(const std::vector<Lanes>& lanes, int batch, int size) : at_(&lanes[static_cast<std::size_t>(batch) * size]) {}
  const Lanes& operator[](int k) const { return at_[k]; }

 private:
  const Lanes* at_;
};
template <>
class ElementData<double> {
 public:
  ElementData(const std::vector<Lanes>& lanes, int element, int size)
      : at_(&lanes[static_cast<std::size_t>(element / Lanes::kCount) * size]), lane_(element % Lanes::kCount) {}
  double operator[](int k) const { return at_[k][lane_]; }

 private:
  const Lanes* at_;
  int lane_;
};

template <class Scalar, int Dim, int Nodes>
struct ElementKernel {
  using Layout = ElementLayout<Dim, Nodes>;
  using Active = ActiveLayout<Dim, Nodes>;
  static constexpr int kModes = Layout::kModes;
  using Data = ElementData<Scalar>;
  using Square = SquareMatrix<Scalar, Dim>;
  using Hourglass = Eigen::Matrix<Scalar, Dim, kModes>;
  using Offsets = Eigen::Matrix<Scalar, Dim, Nodes - 1>;  // nodes 1.. from node 0 [m]

  /// What the energy of an element depends on.
  struct Strain {
    Square F;     // elastic part of the mean deformation gradient [-]
    Hourglass Q;  // hourglass part of the places [m]
  };
  /// The hourglass part in the turned frame.
  struct Turned {
    Square R, U;        // F = R U
    Hourglass h;        // R^T Q [m]
    Hourglass stretch;  // h less its active rest value [m]
    Hourglass force;    // S stretch [N]
    Spin<Scalar, Dim> spin;  // [J] how the energy falls with a turn of the frame: moment of force about h, through U
  };

  static Strain strain_of(const Data& data, const Offsets& offset) {
    Strain strain;
    strain.F.setConstant(Scalar(0.0));
    strain.Q.setConstant(Scalar(0.0));
#pragma GCC unroll 16
    for (int n = 0; n < Nodes - 1; ++n) {
      for (int i = 0; i < Dim; ++i) {
        for (int j = 0; j < Dim; ++j) strain.F(i, j) += offset(i, n) * data[Layout::kGradient + Dim * n + j];
        for (int k = 0; k < kModes; ++k) strain.Q(i, k) += offset(i, n) * data[Layout::kHourglass + kModes * n + k];
      }
    }
    return strain;
  }

  static Square active_inverse(const Data& active) {
    Square inverse;
    for (int k = 0; k < Dim * Dim; ++k) inverse(k) = active[Active::kInverse + k];
    return inverse;
  }
  static Hourglass no_hourglass() { return Hourglass::Constant(Scalar(0.0)); }
  static Hourglass active_hourglass(const Data& active) {
    Hourglass rest;
    for (int k = 0; k < Layout::kCoordinates; ++k) rest(k) = active[Active::kHourglass + k];
    return rest;
  }

  /// S y, the columns of y stacked.
  static Hourglass stiffness_times(const Data& data, const Hourglass& y) {
    Hourglass result;
    result.setConstant(Scalar(0.0));
    int at = Layout::kStiffness;
#pragma GCC unroll 16
    for (int row = 0; row < Layout::kCoordinates; ++row) {
#pragma GCC unroll 16
      for (int column = 0; column < row; ++column, ++at) {
        result(row) += data[at] * y(column);
        result(column) += data[at] * y(row);
      }
      result(row) += data[at++] * y(row);
    }
    return result;
  }

  /// `rest` is what h is without stress [m].
  static Turned turn(const Data& data, const Hourglass& rest, const Strain& strain) {
    Turned turned;
    turned.R = nearest_rotation(strain.F);
    turned.U = turned.R.transpose() * strain.F;
    turned.h = turned.R.transpose() * strain.Q;
    turned.stretch = turned.h - rest;
    turned.force = stiffness_times(data, turned.stretch);
    turned.spin = solve_spin<Scalar, Dim>(turned.U, moment_of<Scalar, Dim, kModes>(turned.h, turned.force));
    return turned;
  }

  static Scalar energy(ElasticLaw law, const Data& data, const Hourglass& rest, const Strain& strain) {
    Scalar energy(0.0);
    if (law == ElasticLaw::kStableNeoHookean) {
      energy = StableNeoHookean<Scalar>(data[Layout::kLambda], data[Layout::kMu]).energy(strain.F);
    } else {
      energy = CorotatedLinear<Scalar>(data[Layout::kLambda], data[Layout::kMu]).energy(strain.F, nearest_rotation(strain.F));
    }
    if constexpr (kModes > 0) {
      const Turned turned = turn(data, rest, strain);
      for (int k = 0; k < Layout::kCoordinates; ++k) energy += Scalar(0.5) * turned.stretch(k) * turned.force(k);
    }
    return energy;
  }

  /// Derivatives of the energy with respect to the strain: to F [J] and to Q [N].
  static void differentiate(ElasticLaw law, const Data& data, const Hourglass& rest, const Strain& strain, Square& stress,
                            Hourglass& force) {
    const Scalar lambda = data[Layout::kLambda], mu = data[Layout::kMu];
    if constexpr (kModes > 0) {
      const Turned turned = turn(data, rest, strain);
      stress = law == ElasticLaw::kStableNeoHookean ? StableNeoHookean<Scalar>(lambda, mu).stress(strain.F)
                                                    : CorotatedLinear<Scalar>(lambda, mu).stress(strain.F, turned.R);
      stress -= turned.R * skew<Scalar, Dim>(turned.spin);
      force = turned.R * turned.force;
    } else {
      stress = law == ElasticLaw::kStableNeoHookean
                   ? StableNeoHookean<Scalar>(lambda, mu).stress(strain.F)
                   : CorotatedLinear<Scalar>(lambda, mu).stress(strain.F, nearest_rotation(strain.F));
    }
  }

  /// Forces on the nodes 1.. [N]; node 0 balances them. `stress` is the derivative with respect to the whole mean gradient.
  static Offsets nodal_forces(const Data& data, const Square& stress, const Hourglass& force) {
    Offsets result;
#pragma GCC unroll 16
    for (int n = 0; n < Nodes - 1; ++n) {
      for (int i = 0; i < Dim; ++i) {
        Scalar sum = stress(i, 0) * data[Layout::kGradient + Dim * n];
        for (int j = 1; j < Dim; ++j) sum += stress(i, j) * data[Layout::kGradient + Dim * n + j];
        for (int k = 0; k < kModes; ++k) sum += force(i, k) * data[Layout::kHourglass + kModes * n + k];
        result(i, n) = -sum;
      }
    }
    return result;
  }
};

}  // namespace hydrostat::physics

#pragma once

#include "physics/element_lanes.h"
#include "physics/material_stress.h"

namespace hydrostat::physics {

// The rotation R nearest to a deformation gradient F (F = R U), and how it turns when F changes, over any scalar.
// A spin is a number in 2D and an axial vector in 3D.

template <class Scalar, int Dim>
using Spin = Eigen::Matrix<Scalar, Dim*(Dim - 1) / 2, 1>;

/// Twice the axial vector of the skew part of A.
template <class Scalar, int Dim>
Spin<Scalar, Dim> axial_difference(const SquareMatrix<Scalar, Dim>& A) {
  if constexpr (Dim == 2) {
    return Spin<Scalar, 2>(A(1, 0) - A(0, 1));
  } else {
    return {A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)};
  }
}

/// The skew matrix W of a spin w: W a = w x a.
template <class Scalar, int Dim>
SquareMatrix<Scalar, Dim> skew(const Spin<Scalar, Dim>& w) {
  SquareMatrix<Scalar, Dim> result;
  const Scalar zero(0.0);
  if constexpr (Dim == 2) {
    result << zero, -w[0], w[0], zero;
  } else {
    result << zero, -w[2], w[1], w[2], zero, -w[0], -w[1], w[0], zero;
  }
  return result;
}

/// Sum of the cross products of the columns of A with those of B.
template <class Scalar, int Dim, int Columns>
Spin<Scalar, Dim> moment_of(const Eigen::Matrix<Scalar, Dim, Columns>& A, const Eigen::Matrix<Scalar, Dim, Columns>& B) {
  Spin<Scalar, Dim> sum = Spin<Scalar, Dim>::Constant(Scalar(0.0));
  for (int k = 0; k < Columns; ++k) {
    if constexpr (Dim == 2) {
      sum[0] += A(0, k) * B(1, k) - A(1, k) * B(0, k);
    } else {
      for (int i = 0; i < 3; ++i) {
        const int a = (i + 1) % 3, b = (i + 2) % 3;
        sum[i] += A(a, k) * B(b, k) - A(b, k) * B(a, k);
      }
    }
  }
  return sum;
}

/// Below this share of |F|^Dim, the product of the sums of pairs of signed stretches counts as zero: F is then about a
/// reflection, and has no nearest rotation.
constexpr double kLeastSpinStiffness = 1e-3;

/// Solves (tr U I - U) w = m: the spin w of R by which the skew part m of R^T dF comes about (m is axial_difference).
/// Where F has no nearest rotation the result is bounded instead of infinite.
template <class Scalar, int Dim>
Spin<Scalar, Dim> solve_spin(const SquareMatrix<Scalar, Dim>& U, const Spin<Scalar, Dim>& m) {
  const Scalar tiny(1e-300);  // for a body collapsed to a point, which has no moment
  const Scalar size_squared = squared_norm(U);
  if constexpr (Dim == 2) {
    const Scalar trace = U(0, 0) + U(1, 1);
    return Spin<Scalar, 2>(m[0] * trace / greater_of(trace * trace, size_squared * Scalar(kLeastSpinStiffness) + tiny));
  } else {
    const Scalar trace = U(0, 0) + U(1, 1) + U(2, 2);
    SquareMatrix<Scalar, 3> Z = -U;
    for (int i = 0; i < 3; ++i) Z(i, i) += trace;
    const SquareMatrix<Scalar, 3> adjugate = cofactor(Z);  // Z is symmetric
    using std::sqrt;
    const Scalar least = size_squared * sqrt(size_squared) * Scalar(kLeastSpinStiffness) + tiny;
    const Scalar scale = Scalar(1) / greater_of(determinant(Z, adjugate), least);
    Spin<Scalar, 3> w;
    for (int i = 0; i < 3; ++i) w[i] = scale * (adjugate(i, 0) * m[0] + adjugate(i, 1) * m[1] + adjugate(i, 2) * m[2]);
    return w;
  }
}

/// F = U diag(stretch) V^T with rotations U and V; the stretches fall in size, and the last is negative where F is inverted.
template <int Dim>
struct SignedSingularValues {
  SquareMatrix<double, Dim> U, V;
  Eigen::Matrix<double, Dim, 1> stretch;
};
template <int Dim>
SignedSingularValues<Dim> signed_singular_values(const SquareMatrix<double, Dim>& F);

/// The rotation nearest to F: of every finite F, also of an inverted or a singular one.
template <class Scalar>
SquareMatrix<Scalar, 2> nearest_rotation(const SquareMatrix<Scalar, 2>& F) {
  const Scalar zero(0.0), one(1.0);
  Scalar cosine = F(0, 0) + F(1, 1), sine = F(1, 0) - F(0, 1);
  const Scalar size_squared = cosine * cosine + sine * sine;
  cosine = where_positive(size_squared, cosine, one);  // a reflection: any rotation is as near
  using std::sqrt;
  const Scalar scale = one / sqrt(where_positive(size_squared, size_squared, one));
  sine = where_positive(size_squared, sine, zero);
  SquareMatrix<Scalar, 2> R;
  R << cosine * scale, -(sine * scale), sine * scale, cosine * scale;
  return R;
}

/// Replaces R by the rotation from the singular values of F, in each lane where `sound` is not positive.
void repair_rotation(const SquareMatrix<Lanes, 3>& F, const Lanes& sound, SquareMatrix<Lanes, 3>& R);
void repair_rotation(const SquareMatrix<double, 3>& F, double sound, SquareMatrix<double, 3>& R);

/// Sum of the signed stretches of F, from |F|^2, |cof F|^2 and det F: the greatest root of
/// (x^2 - |F|^2)^2 / 4 - |cof F|^2 - 2 x det F, which Newton's iteration meets from above.
template <class Scalar>
Scalar trace_of_stretch(const Scalar& F_squared, const Scalar& cofactor_squared, const Scalar& J) {
  constexpr double kDone = 1e-18;  // square of a relative change after which the next one is rounding
  constexpr int kMostSweeps = 60;
  using std::sqrt;
  Scalar x = sqrt(Scalar(3) * F_squared);
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    const Scalar second = Scalar(0.5) * (x * x - F_squared);  // of the invariants of U
    const Scalar change = (second * second - cofactor_squared - Scalar(2) * x * J) / (Scalar(2) * (x * second - J));
    x -= change;
    if (all_positive(Scalar(kDone) * x * x - change * change)) break;
  }
  return x;
}

/// R = [(I^2 - II) F + I cof F - F F^T F] / (I II - III) with the invariants I, II, III of U: right for every stretch by the
/// theorem of Cayley and Hamilton, inverted ones too. Singular values where no rotation is nearest.
/// Source of the way over the invariants: Hoger, Carlson, "Determination of the stretch and rotation in the polar
/// decomposition of the deformation gradient", Quarterly of Applied Mathematics 42, 1984; the formula for R is ours.
template <class Scalar>
SquareMatrix<Scalar, 3> nearest_rotation(const SquareMatrix<Scalar, 3>& F) {
  using std::sqrt;
  const SquareMatrix<Scalar, 3> slope = cofactor(F), square = F.transpose() * F;
  const Scalar size_squared = squared_norm(F), J = determinant(F, slope);
  const Scalar first = trace_of_stretch(size_squared, squared_norm(slope), J);
  const Scalar second = Scalar(0.5) * (first * first - size_squared), stiffness = first * second - J;
  const Scalar scale = Scalar(1) / stiffness, of_F = (first * first - second) * scale, of_slope = first * scale;
  SquareMatrix<Scalar, 3> R = F * square;
  for (int k = 0; k < 9; ++k) R(k) = of_F * F(k) + of_slope * slope(k) - scale * R(k);
  const Scalar sound = stiffness - Scalar(kLeastSpinStiffness) * size_squared * sqrt(size_squared);
  if (!all_positive(sound)) repair_rotation(F, sound, R);
  return R;
}

}  // namespace hydrostat::physics

#pragma once

#include <Eigen/Core>
#include <cmath>

namespace hydrostat::physics {

// The laws as formulas over any scalar, so that one element and four at once (element_lanes.h) share them.

template <class Scalar, int Dim>
using SquareMatrix = Eigen::Matrix<Scalar, Dim, Dim>;

/// Derivative of det F with respect to F.
template <class Scalar>
SquareMatrix<Scalar, 2> cofactor(const SquareMatrix<Scalar, 2>& F) {
  SquareMatrix<Scalar, 2> result;
  result << F(1, 1), -F(1, 0), -F(0, 1), F(0, 0);
  return result;
}

template <class Scalar>
SquareMatrix<Scalar, 3> cofactor(const SquareMatrix<Scalar, 3>& F) {
  SquareMatrix<Scalar, 3> result;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      result(i, j) = F(a, c) * F(b, d) - F(a, d) * F(b, c);
    }
  }
  return result;
}

/// det F, from the first column of F and of its cofactor.
template <class Scalar, int Dim>
Scalar determinant(const SquareMatrix<Scalar, Dim>& F, const SquareMatrix<Scalar, Dim>& cofactor_of_F) {
  Scalar sum = F(0, 0) * cofactor_of_F(0, 0);
  for (int i = 1; i < Dim; ++i) sum += F(i, 0) * cofactor_of_F(i, 0);
  return sum;
}

template <class Scalar, int Dim>
Scalar squared_norm(const SquareMatrix<Scalar, Dim>& F) {
  Scalar sum(0.0);
  for (int j = 0; j < Dim; ++j) {  // sums of columns do not wait for one another
    Scalar of_column = F(0, j) * F(0, j);
    for (int i = 1; i < Dim; ++i) of_column += F(i, j) * F(i, j);
    sum += of_column;
  }
  return sum;
}

/// Stable neo-Hookean flesh. Its constants follow from Lamé's as the paper's section 3.4 says, so that small strains obey
/// Hooke's law; in 2D the third stretch is 1.
/// Source: Smith, de Goes, Kim, "Stable neo-Hookean flesh simulation", TOG 37(2), 2018, eq. (14).
template <class Scalar>
struct StableNeoHookean {
  Scalar mu, lambda;  // the paper's own

  StableNeoHookean(const Scalar& lame_lambda, const Scalar& lame_mu)
      : mu(lame_mu * Scalar(4.0 / 3)), lambda(lame_lambda + lame_mu * Scalar(5.0 / 6)) {}

  /// lambda (J - alpha), the factor of the cofactor in the stress.
  Scalar pressure(const Scalar& J) const { return lambda * (J - Scalar(1)) - Scalar(0.75) * mu; }

  template <int Dim>
  Scalar energy(const SquareMatrix<Scalar, Dim>& F) const {
    using std::log1p;
    const Scalar growth = squared_norm(F) - Scalar(Dim);  // of the first invariant
    const Scalar swelling = determinant(F, cofactor(F)) - Scalar(1);
    return Scalar(0.5) * mu * (growth - log1p(growth * Scalar(0.25))) +
           swelling * (Scalar(0.5) * lambda * swelling - Scalar(0.75) * mu);
  }

  template <int Dim>
  SquareMatrix<Scalar, Dim> stress(const SquareMatrix<Scalar, Dim>& F) const {
    const SquareMatrix<Scalar, Dim> slope = cofactor(F);
    const Scalar invariant = squared_norm(F) + Scalar(4 - Dim);  // one more than the first invariant
    const Scalar shear = mu - mu / invariant, push = pressure(determinant(F, slope));
    SquareMatrix<Scalar, Dim> result;
    for (int i = 0; i < Dim; ++i) {
      for (int j = 0; j < Dim; ++j) result(i, j) = shear * F(i, j) + push * slope(i, j);
    }
    return result;
  }
};

/// Corotated linear elasticity: mu |F - R|^2 + lambda / 2 tr(R^T F - I)^2, R the rotation nearest to F.
/// Source: Müller, Gross, "Interactive virtual materials", GI 2004; as an energy of F in Smith, de Goes, Kim 2019, eq. (2).
template <class Scalar>
struct CorotatedLinear {
  Scalar lambda, mu;

  CorotatedLinear(const Scalar& lame_lambda, const Scalar& lame_mu) : lambda(lame_lambda), mu(lame_mu) {}

  template <int Dim>
  static Scalar trace_of_strain(const SquareMatrix<Scalar, Dim>& F, const SquareMatrix<Scalar, Dim>& R) {
    Scalar sum = Scalar(-Dim);
    for (int k = 0; k < Dim * Dim; ++k) sum += R(k / Dim, k % Dim) * F(k / Dim, k % Dim);
    return sum;
  }

  template <int Dim>
  Scalar energy(const SquareMatrix<Scalar, Dim>& F, const SquareMatrix<Scalar, Dim>& R) const {
    const Scalar trace = trace_of_strain(F, R);
    const SquareMatrix<Scalar, Dim> stretch = F - R;
    return mu * squared_norm(stretch) + Scalar(0.5) * lambda * trace * trace;
  }

  template <int Dim>
  SquareMatrix<Scalar, Dim> stress(const SquareMatrix<Scalar, Dim>& F, const SquareMatrix<Scalar, Dim>& R) const {
    const Scalar push = lambda * trace_of_strain(F, R);
    SquareMatrix<Scalar, Dim> result;
    for (int i = 0; i < Dim; ++i) {
      for (int j = 0; j < Dim; ++j) result(i, j) = Scalar(2) * mu * (F(i, j) - R(i, j)) + push * R(i, j);
    }
    return result;
  }
};

}  // namespace hydrostat::physics

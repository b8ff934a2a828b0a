#include "physics/material.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "physics/material_rotation.h"
#include "physics/material_stress.h"

namespace hydrostat::physics {
namespace {

// What the two laws differ in once F = U diag(s) V^T is known: second derivatives of the energy in the stretches s, and the
// eigenvalues of the modes that turn the principal axes i and j against (twist) and with (flip) each other.
template <int Dim>
struct Spectrum {
  SquareMatrix<double, Dim> scaling = SquareMatrix<double, Dim>::Zero();
  SquareMatrix<double, Dim> twist = scaling, flip = scaling;  // entries i < j
};

template <int Dim>
Spectrum<Dim> spectrum_of(const StableNeoHookean<double>& law, const Eigen::Matrix<double, Dim, 1>& s) {
  const double invariant = s.squaredNorm() + (4 - Dim), shear = law.mu - law.mu / invariant;
  const double pressure = law.pressure(s.prod());
  SquareMatrix<double, Dim> turned = s.asDiagonal();
  const Eigen::Matrix<double, Dim, 1> slope = cofactor(turned).diagonal();
  Spectrum<Dim> result;
  result.scaling = (2 * law.mu / (invariant * invariant)) * s * s.transpose() + law.lambda * slope * slope.transpose();
  for (int i = 0; i < Dim; ++i) {
    result.scaling(i, i) += shear;
    for (int j = i + 1; j < Dim; ++j) {
      const double third = pressure * (Dim == 3 ? s[3 - i - j] : 1);  // the stretch across i and j
      result.scaling(i, j) += third;
      result.scaling(j, i) += third;
      result.twist(i, j) = shear + third;
      result.flip(i, j) = shear - third;
    }
  }
  return result;
}

template <int Dim>
Spectrum<Dim> spectrum_of(const CorotatedLinear<double>& law, const Eigen::Matrix<double, Dim, 1>& s) {
  constexpr double kLeastSum = 1e-8;  // of two stretches: below, F is a reflection and its rotation jumps
  const double pressure = law.lambda * (s.sum() - Dim);
  Spectrum<Dim> result;
  result.scaling.setConstant(law.lambda);
  for (int i = 0; i < Dim; ++i) {
    result.scaling(i, i) += 2 * law.mu;
    for (int j = i + 1; j < Dim; ++j) {
      result.twist(i, j) = 2 * law.mu + (2 * pressure - 4 * law.mu) / std::max(s[i] + s[j], kLeastSum);
      result.flip(i, j) = 2 * law.mu;
    }
  }
  return result;
}

template <int Dim>
void keep_positive(Spectrum<Dim>& spectrum) {
  const Eigen::SelfAdjointEigenSolver<SquareMatrix<double, Dim>> modes(spectrum.scaling);
  spectrum.scaling =
      modes.eigenvectors() * modes.eigenvalues().cwiseMax(0).asDiagonal() * modes.eigenvectors().transpose();
  spectrum.twist = spectrum.twist.cwiseMax(0);
  spectrum.flip = spectrum.flip.cwiseMax(0);
}

template <int Dim>
GradientDerivative<Dim> assemble(const Spectrum<Dim>& spectrum, const SignedSingularValues<Dim>& svd) {
  GradientDerivative<Dim> result = GradientDerivative<Dim>::Zero();
  const auto dyad = [&](int i, int j) -> Gradient<Dim> { return svd.U.col(i) * svd.V.col(j).transpose(); };
  for (int i = 0; i < Dim; ++i) {
    const Gradient<Dim> scale_i = dyad(i, i);
    for (int j = 0; j < Dim; ++j) {
      const Gradient<Dim> scale_j = dyad(j, j);
      result += spectrum.scaling(i, j) * scale_i.reshaped() * scale_j.reshaped().transpose();
    }
    for (int j = i + 1; j < Dim; ++j) {
      const Gradient<Dim> twist = (dyad(i, j) - dyad(j, i)) * std::sqrt(0.5), flip = (dyad(i, j) + dyad(j, i)) * std::sqrt(0.5);
      result += spectrum.twist(i, j) * twist.reshaped() * twist.reshaped().transpose() +
                spectrum.flip(i, j) * flip.reshaped() * flip.reshaped().transpose();
    }
  }
  return result;
}

}  // namespace

std::string name_of(ElasticLaw law) { return law == ElasticLaw::kStableNeoHookean ? "stable neo-Hookean" : "corotated linear"; }

Lame lame_of(double youngs_modulus, double poissons_ratio) {
  return {youngs_modulus * poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio)),
          youngs_modulus / (2 * (1 + poissons_ratio))};
}

std::string broken_rule(double youngs_modulus, double poissons_ratio) {
  if (!(youngs_modulus > 0) || !std::isfinite(youngs_modulus)) return "Young's modulus must be above 0 Pa";
  if (!(poissons_ratio >= 0 && poissons_ratio < 0.5)) return "Poisson's ratio must be at least 0 and below 0.5";
  return {};
}

template <int Dim>
double energy_density(ElasticLaw law, const Lame& lame, const Gradient<Dim>& F) {
  if (law == ElasticLaw::kStableNeoHookean) return StableNeoHookean<double>(lame.lambda, lame.mu).energy(F);
  return CorotatedLinear<double>(lame.lambda, lame.mu).energy(F, nearest_rotation(F));
}

template <int Dim>
Gradient<Dim> first_piola_stress(ElasticLaw law, const Lame& lame, const Gradient<Dim>& F) {
  if (law == ElasticLaw::kStableNeoHookean) return StableNeoHookean<double>(lame.lambda, lame.mu).stress(F);
  return CorotatedLinear<double>(lame.lambda, lame.mu).stress(F, nearest_rotation(F));
}

template <int Dim>
GradientDerivative<Dim> stress_derivative(ElasticLaw law, const Lame& lame, const Gradient<Dim>& F,
                                          Definiteness definiteness) {
  const SignedSingularValues<Dim> svd = signed_singular_values<Dim>(F);
  Spectrum<Dim> spectrum = law == ElasticLaw::kStableNeoHookean
                               ? spectrum_of<Dim>(StableNeoHookean<double>(lame.lambda, lame.mu), svd.stretch)
                               : spectrum_of<Dim>(CorotatedLinear<double>(lame.lambda, lame.mu), svd.stretch);
  if (definiteness == Definiteness::kProjected) keep_positive(spectrum);
  return assemble(spectrum, svd);
}

template double energy_density<2>(ElasticLaw, const Lame&, const Gradient<2>&);
template double energy_density<3>(ElasticLaw, const Lame&, const Gradient<3>&);
template Gradient<2> first_piola_stress<2>(ElasticLaw, const Lame&, const Gradient<2>&);
template Gradient<3> first_piola_stress<3>(ElasticLaw, const Lame&, const Gradient<3>&);
template GradientDerivative<2> stress_derivative<2>(ElasticLaw, const Lame&, const Gradient<2>&, Definiteness);
template GradientDerivative<3> stress_derivative<3>(ElasticLaw, const Lame&, const Gradient<3>&, Definiteness);

}  // namespace hydrostat::physics

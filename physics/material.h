#pragma once

#include <Eigen/Core>
#include <string>

namespace hydrostat::physics {

/// Isotropic hyperelastic laws. Both linearise to Hooke's law with the Lamé parameters given; in 2D they are the plane-strain
/// form of the 3D law, per metre of thickness.
enum class ElasticLaw {
  kStableNeoHookean,  // bends, stretches and inverts without trouble, keeps volume; needs no rotation
  kCorotatedLinear,   // Hooke's law in the turned frame; exact for small strain, lets a strongly squeezed element collapse
};
std::string name_of(ElasticLaw law);

struct Lame {
  double lambda = 0;  // [Pa]
  double mu = 0;      // [Pa] shear modulus
};

/// Lamé parameters of Young's modulus [Pa] and Poisson's ratio [-]; the rules of broken_rule must hold.
Lame lame_of(double youngs_modulus, double poissons_ratio);
/// Which value breaks which rule, empty when all is well: Young's modulus > 0, 0 <= Poisson's ratio < 0.5.
std::string broken_rule(double youngs_modulus, double poissons_ratio);

enum class Definiteness {
  kExact,      // the second derivative as it is
  kProjected,  // the nearest positive semi-definite matrix: negative eigenvalues become zero
};

template <int Dim>
using Gradient = Eigen::Matrix<double, Dim, Dim>;  // deformation gradient F [-], or the stress P [Pa] that works on it
template <int Dim>
using GradientDerivative = Eigen::Matrix<double, Dim * Dim, Dim * Dim>;  // dP/dF [Pa], both as columns stacked

/// Elastic energy per rest volume [J/m3]; 0 at rest.
template <int Dim>
double energy_density(ElasticLaw law, const Lame& lame, const Gradient<Dim>& deformation);

/// First Piola-Kirchhoff stress [Pa], the derivative of energy_density.
template <int Dim>
Gradient<Dim> first_piola_stress(ElasticLaw law, const Lame& lame, const Gradient<Dim>& deformation);

/// Derivative of the stress [Pa], from its analytic eigensystem.
/// Source: Smith, de Goes, Kim, "Stable neo-Hookean flesh simulation", TOG 37(2), 2018, section 4;
/// Smith, de Goes, Kim, "Analytic eigensystems for isotropic distortion energies", TOG 38(1), 2019, section 5.
/// Departs from them in 2D (plane strain), and in that the scaling modes come from a Dim x Dim eigenproblem in numbers.
template <int Dim>
GradientDerivative<Dim> stress_derivative(ElasticLaw law, const Lame& lame, const Gradient<Dim>& deformation,
                                          Definiteness definiteness);

}  // namespace hydrostat::physics

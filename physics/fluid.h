#pragma once

#include "physics/effect.h"

namespace hydrostat::physics {

/// Bears the weight of what it would fill and resists what moves through it, by the faces of the body's surface.
///
/// Pressure grows with the depth: its integral over each face is shared out to the nodes exactly, so that a body all under
/// water feels Archimedes' force in the middle of its volume, to rounding. Resistance is that of faces that move against the
/// fluid, quadratic in their speed: rho / 2 times a coefficient, times their area, along the normal and, with another one,
/// along the face (a slender body that waves thus swims). It is taken at the start of a step and shortened so that no step
/// turns a velocity around. Its flow does not heed the body, nor does the mass of what is
/// carried along with the body count.
/// Source: Gray, Hancock, "The propulsion of sea-urchin spermatozoa", J. Exp. Biol. 32, 1955 (two coefficients), with the
/// quadratic law of Taylor, "Analysis of the swimming of long and narrow animals", Proc. R. Soc. A 214, 1952.
template <int Dim>
class FluidEffect final : public EffectOf<Dim> {
 public:
  FluidEffect(const SceneOf<Dim>& scene, const FluidOf<Dim>& fluid);
  void add_forces(double dt, const StateOf<Dim>& state, PointsOf<Dim>& force) override;

 private:
  const SceneOf<Dim>& scene_;
  const FluidOf<Dim> fluid_;
  Eigen::Matrix<int, Dim, Eigen::Dynamic> faces_;  // counter-clockwise seen from outside
  VectorOf<Dim> up_;
  double gravity_;      // [m/s2]
  PointsOf<Dim> drag_;  // [N]
};

}  // namespace hydrostat::physics

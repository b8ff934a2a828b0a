#pragma once

#include <vector>

#include "physics/effect.h"

namespace hydrostat::physics {

/// Bears the weight of what it would fill and resists what moves through it, by the faces of the body's surface.
///
/// Pressure grows with the depth: its integral over each face is shared out to the nodes exactly, so that a body all under
/// water feels Archimedes' force in the middle of its volume, to rounding. Depth counts from the fluid's level. Where that is
/// everywhere it counts from the centre of mass of each part that hangs together: the same pressure all around has no
/// resultant, and no place is told where it would be 0; so nothing hangs on the height.
/// A tet that displaces a share of its volume (displaced_share) has that share of the pressure on all its faces: the forces are
/// those of the volume displaced, in its middle, and since a tet's stiffness follows its fill alike, it gives way to them as the
/// matter itself would. Between tets of the same share they cancel.
///
/// Resistance is that of faces that move against the
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
  void find_heights(const PointsOf<Dim>& x);

  const SceneOf<Dim>& scene_;
  const FluidOf<Dim> fluid_;
  Eigen::Matrix<int, Dim, Eigen::Dynamic> faces_;  // counter-clockwise seen from outside; of the surface, then between tets
  Eigen::VectorXd displaced_share_;                // [-] F, of the pressure
  Eigen::Index surface_count_ = 0;
  std::vector<int> part_;                          // N, each named by one of its nodes
  Eigen::VectorXd part_mass_, height_;             // [kg], [m] upward of its centre of mass; by its name
  VectorOf<Dim> up_;
  double gravity_;      // [m/s2]
  PointsOf<Dim> drag_;  // [N]
};

}  // namespace hydrostat::physics

#pragma once

#include <vector>

#include "retarget/level.h"

namespace hydrostat::retarget {

/// The finer mesh on which flesh swings: as the control mesh is made, in a lattice of about half its cells.
struct Flesh {
  ControlMesh mesh;         // n nodes
  Embedding skin;           // of the skin's vertices
  std::vector<char> held;   // n: goes with the control mesh
};

/// What of a creature swings: not what lies nearer to its bones than to its skin, not the cells that a bone runs through, and
/// not what carries skin that the clip brings to the ground. `rig`: its bone_weights are those of the performer's mesh.
Flesh make_flesh(const Performer& performer, const Rig& rig);

/// Vibration modes of flesh, as a Wobble has them but for mean_load and start: the `count` lowest (fewer where little
/// swings). Linear elasticity about the bind pose on the cells as hexahedra; one stiffness for all flesh,
/// kFleshSoftness.
Wobble flesh_modes(const Performer& performer, const Rig& rig, const Flesh& flesh, Eigen::Index count);

/// rho g L / E of flesh [-], as CreatureOptions.softness is of the body, which bears itself and is 40 times stiffer: at
/// L = 1 m a Young's modulus of 49 kPa. It lies between what was measured of skin with fat, 26 kPa, and of muscle, 62 kPa,
/// under light pressure: "Young's moduli of subcutaneous tissues and muscles under different loads at the gluteal region
/// calculated using ultrasonography", Journal of Physical Therapy Science 34, 2022.
constexpr double kFleshSoftness = 0.2;

}  // namespace hydrostat::retarget

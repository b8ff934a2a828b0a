#pragma once

#include <string>
#include <vector>

#include "physics/stepper.h"
#include "retarget/body_material.h"
#include "retarget/clip.h"
#include "retarget/control_mesh.h"
#include "retarget/coupling.h"
#include "retarget/inverse_dynamics.h"
#include "retarget/morphs.h"
#include "retarget/muscles.h"
#include "retarget/prepare.h"
#include "retarget/replay.h"
#include "retarget/root_motion.h"

namespace hydrostat::retarget {

/// Every default of a conversion, the same for every clip.
struct CreatureOptions {
  double height_m = 0;         // of the bind pose; 0 keeps the file's size where that is a creature's
  int nodes = 0;               // 0: automatic
  RootMotion root_motion = RootMotion::kAuto;
  double limit = 0;            // of |activation - 1|; 0: automatic
  double firmness = 1;         // of the preparation, as is the next, see PrepareOptions
  bool spread_load = false;
  bool fitted_rest_lengths = false;  // of springs, see fit_rest_lengths
  double density = 1000;       // [kg/m3]
  double softness = 0.005;     // rho g L / E
  bool hexahedra = false;      // the lattice's cells are the elements, not the tets they are cut into: not of springs
  BodyMaterial material = BodyMaterial::kSprings;
  double poissons_ratio = 0.4;  // of finite elements
  bool calibrated = false;      // tets of finite elements bend as the cells would that they are cut from (unlocking_factor)
  double damping_time = 0.01;  // [s] at L = 1 m, grows with the square root of L
  double friction = 0.8;
  double rate_hz = 60;
  physics::Method method = physics::Method::kExplicit;
  int threads = 2;
};

/// The body of a character and the ground it stands on.
struct Creature {
  Character character;         // scaled
  double scale = 1;
  ControlMesh mesh;
  Embedding skin;              // of the skin's vertices
  ContactPoints contacts;
  physics::Scene scene;
  double length = 1, size = 1; // L and D [m]
  bool is_mirror_image = false;  // of itself all through a loop: it hops, or crawls straight on
  double youngs_modulus = 0;   // [Pa]; what calibrated tets have less is told by the body's elements alone
  std::vector<std::string> warnings;
};

/// The scene in which a target is prepared: nodes and masses are the creature's own, and springs and volumes of its tets
/// keep the shape, whatever bears the stress when it is let go.
physics::Scene preparation_scene(const Creature& creature);

Creature make_creature(const Character& character, const CreatureOptions& options);

/// The imported motion on the control mesh: with its travel, closed to a loop where it is one.
struct ImportedMotion {
  Motion nodes;                // 3N x F
  Motion skin_points;          // the contact points' vertices as the clip has them, 3P x F
  Motion skin;                 // all of its vertices likewise, at 30 Hz where the frames allow, 3V x F
  MovingMorphs morphs;         // what the body leaves of the clip's
  CouplingReport coupling;
  std::string root_motion;     // "clip", "from feet" or "none"
  std::vector<std::string> warnings;
};

ImportedMotion import_motion(const Creature& creature, const CreatureOptions& options);

/// How a clip's contacts are to be read. Where its travel was recovered from its feet the pace is a guess, and what touches the ground is
/// taken to stand on it.
PrepareOptions prepare_options(const ImportedMotion& imported);

/// Names of all bones and the bone of each contact point, as label_contacts and prepare want them.
std::vector<int> bones_of(const ContactPoints& contacts);

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/Core>
#include <string>

#include "retarget/clip.h"
#include "retarget/control_mesh.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

struct CouplingOptions {
  double anchor_distance = 1;  // [cells] from a node to its anchors
  double elasticity = 0.02;    // strength of an edge over that of a node's anchors
  double least_weight = 0.05;  // bones of less weight hold no anchors of a node
  double least_morph = 0.01;   // of the skin's longest side: a morph target that never moves a node so far leaves the body alone
  double most_volume_change = 0.1;  // of what such a target moves: a body that keeps its volume cannot follow more
  bool symmetric = false;      // twice as many anchors, so that a motion that is its own mirror image stays so on a mesh that is
  int max_iterations = 30;     // of the solver, a frame
  int threads = 1;             // frames are solved apart from each other: the outcome does not hang on it
};

/// Which value of the options breaks which rule, empty when all is well.
std::string broken_rule(const CouplingOptions& options);

/// What the bones make of the control mesh over a clip.
struct CoupledMotion {
  Motion motion;  // F frames of the clip, at its rate, not yet a loop
  double error_rms_length =
      0;  // embedded skin against linear blend skinning, over vertices and frames, per longest side of the skin
  double error_max_length = 0;
  int worst_frame = 0;         // where the largest error is
  int unconverged_frames = 0;  // frames where the solver came to its last iteration
  std::vector<Eigen::Matrix3Xd> node_morphs;  // [m] 3 x N: what the nodes carry of each morph target, 0 of most; none: of all nothing
  std::vector<std::string> left_large_morphs;  // names of those that are large and yet not carried, for they change volume
};

/// Plays the clip on the control mesh. Each node hangs on four anchors, the corners of a tetrahedron about it, or where symmetric
/// on all eight of a cube's, on each bone that owns it, by distance constraints of the bind pose's lengths with the bone's weight as strength;
/// anchors move with their bones. Per frame the node positions are those that minimise the constraints' errors and those of the mesh's edges,
/// from linear blend skinning as first guess. A bone that stretches or squashes takes the lengths along. Rigid motion of all
/// bones is reproduced exactly. Morph targets that are large enough for the mesh and keep the volume of what they move
/// move the nodes in the bind pose, as the skin around them (retarget/morphs.h). skin_embedding is that of the skin's vertices. Throws Error where the clip has no frame.
CoupledMotion couple(const Character& character, const ControlMesh& mesh, const Embedding& skin_embedding,
                     const CouplingOptions& options = {});

}  // namespace hydrostat::retarget

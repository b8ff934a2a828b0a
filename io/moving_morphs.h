#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "retarget/control_mesh.h"
#include "retarget/morphs.h"
#include "retarget/motion.h"

namespace hydrostat::io {

/// Morph targets of a skin that all joints turn alike: in frame f the vertices lie, before the turn, off their places by the
/// sum of the shapes times their weights.
struct PlayedMorphs {
  std::vector<std::string> names;        // K
  std::vector<Eigen::Matrix3Xd> shapes;  // K, [m] 3 x V, in the bind pose
  Eigen::MatrixXd weights;               // K x F [-]
};

/// What a creature wears, played on its moving body: the morph targets turn with the body around them (at a vertex as at the
/// nodes that carry it). First come the morph targets by their names, with the clip's weights and the offsets that are right
/// for the mean turn against `turns`, which all share (of each frame, F); then, where the body turns away from that, at
/// most four "turning" ones, the principal components of what is left, as many as bring it below 2 % of
/// what is worn or 0.01 % of the body's longest side (RMS).
PlayedMorphs play_morphs(const retarget::MovingMorphs& morphs, const retarget::Embedding& skin_embedding,
                         const retarget::ControlMesh& body, const retarget::Motion& motion,
                         const std::vector<Eigen::Quaterniond>& turns);

}  // namespace hydrostat::io

#pragma once

#include <Eigen/Core>
#include <vector>

#include "retarget/clip.h"
#include "retarget/control_mesh.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// The morph targets that a creature wears over the skin that its body carries, and the course of their weights. Time 0 is
/// the target motion's.
struct MovingMorphs {
  std::vector<MorphTarget> targets;  // K, of the skin's vertices
  Eigen::MatrixXd weights;           // K x F [-]
  double rate_hz = 60;
  bool loop = false;  // the frame behind the last is the first

  /// At a time [s] >= 0, K: straight between frames; a loop goes on for ever, a one-shot holds its last.
  Eigen::VectorXd at(double time_s) const;
};

/// What the control mesh carries of a skin's morph targets: node offsets [m], 3 x N each, that fit the vertices' best
/// (least squares) and spread evenly into the nodes that carry no skin.
std::vector<Eigen::Matrix3Xd> carried_by_nodes(const std::vector<MorphTarget>& morphs, const ControlMesh& mesh,
                                               const Embedding& skin_embedding);

/// What is left, but for thousandths, of morph targets when nodes carry so much of them (as many, 3 x N each; none at all: nothing).
std::vector<MorphTarget> left_by_nodes(const std::vector<MorphTarget>& morphs, const std::vector<Eigen::Matrix3Xd>& carried,
                                       const Embedding& skin_embedding);

/// Weights over a clip's frames, K x F or more, as those of `motion`, which is made of its frames: of a loop the frame that
/// repeats the first is left out, and what the weights miss their start by at the end is spread over the period as the
/// loop's own defect is (retarget/loop.h).
Eigen::MatrixXd closed_weights(const Eigen::MatrixXd& clip_weights, const Motion& motion);

/// How the body turns at some of its control nodes.
class NodeTurns {
 public:
  NodeTurns(const ControlMesh& mesh, std::vector<int> nodes);
  /// The rotations that take each node and its neighbours along edges of tets (the mesh's own edges where it has no tets) closest
  /// from the bind pose to `positions` [m], 3 x N; `otherwise` where there are fewer than three neighbours.
  std::vector<Eigen::Quaterniond> at(const Eigen::Ref<const Eigen::Matrix3Xd>& positions,
                                     const Eigen::Quaterniond& otherwise) const;

 private:
  const Eigen::Matrix3Xd& bind_pose_;
  std::vector<std::vector<int>> stars_;  // of each of the nodes: itself and those around it
};

}  // namespace hydrostat::retarget

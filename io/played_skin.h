#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "io/appearance.h"
#include "io/moving_morphs.h"
#include "retarget/control_mesh.h"
#include "retarget/morphs.h"
#include "retarget/motion.h"

namespace hydrostat::io {

/// A surface that a control mesh carries, as it lies in the bind pose.
struct EmbeddedSkin {
  const Eigen::Matrix3Xd& vertices;                // [m] 3 x V
  const Eigen::Matrix3Xi& triangles;               // 3 x T
  const retarget::Embedding& embedding;            // of the V vertices in the control mesh
  const Appearance* appearance = nullptr;          // null, or without parts: one colour, and normals of the smooth surface
  const retarget::MovingMorphs* morphs = nullptr;  // worn over what the body carries; null, or without targets: nothing
};

/// The appearance's parts, or all of the skin as one smooth part.
std::vector<Appearance::Part> parts_of(const EmbeddedSkin& skin);

/// A skin that moves with a control mesh as engines play it (io/gltf_out.h). A loop ends with its first frame, moved on by
/// one period. What the skin was made of has to outlive it.
class PlayedSkin {
 public:
  /// mass: of the nodes, N [kg]; motion: of the nodes, at least one frame.
  PlayedSkin(const EmbeddedSkin& skin, const retarget::ControlMesh& body, const Eigen::Ref<const Eigen::VectorXd>& mass,
             const retarget::Motion& motion);

  const retarget::Motion& motion() const { return motion_; }               // of the nodes, no loop any more
  const std::vector<Eigen::Quaterniond>& turns() const { return turns_; }  // of each frame, which all joints share
  const PlayedMorphs& morphs() const { return morphs_; }

  /// Where nodes alone carry the vertices in the bind pose, and nodes and morph targets in a frame: [m] 3 x V, without what
  /// the embedding misses the skin by.
  Eigen::Matrix3Xd carried_in_bind_pose() const;
  Eigen::Matrix3Xd carried_at(Eigen::Index frame) const;

  struct Pose {
    Eigen::Matrix3Xd vertices;  // [m] 3 x V
    Eigen::Quaterniond turn;    // which all joints share
  };
  /// As an engine shows it at a time [s] from 0 to the motion's end: straight between the frames, turns by slerp.
  Pose at(double time_s) const;

 private:
  Eigen::Matrix3Xd carried(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const Eigen::Quaterniond& turn,
                           const Eigen::VectorXd& weights) const;

  const retarget::Embedding& embedding_;
  const Eigen::Matrix3Xd& bind_nodes_;
  retarget::Motion motion_;
  std::vector<Eigen::Quaterniond> turns_;
  PlayedMorphs morphs_;
  Eigen::Matrix3Xd missed_;  // [m] 3 x V, by the embedding in the bind pose
};

}  // namespace hydrostat::io

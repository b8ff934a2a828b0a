#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace hydrostat::retarget {

/// Bones in the order "parent before child".
struct Skeleton {
  std::vector<std::string> names;          // B
  std::vector<int> parents;                // B; -1 is a root
  std::vector<Eigen::Affine3d> bind_pose;  // B; bone space to bind space [m], y up
  std::vector<bool> weighted;              // B; moves skin

  int count() const { return static_cast<int>(names.size()); }
};

/// A shape that a skin can take on beside the one that it is bound in, by a weight [-].
struct MorphTarget {
  std::string name;
  Eigen::VectorXi vertices;  // M, of the skin: those that it moves, each once
  Eigen::Matrix3Xd offsets;  // [m] 3 x M, at weight 1, in the bind pose
};

/// The skin in its bind pose: all meshes of the file merged by bone, in metres, y up, as it stands (root turned upright).
struct SkinnedMesh {
  struct Influence {
    int bone;
    double weight;
  };
  Eigen::Matrix3Xd vertices;                         // [m] 3 x V, bind pose
  Eigen::Matrix3Xi triangles;                        // 3 x T
  std::vector<std::vector<Influence>> skin_weights;  // V; each sums to 1
  std::vector<MorphTarget> morphs = {};              // K; those that some clip moves
};

/// One clip, sampled at uniform times from its first key (frame 0) to its last key (frame F - 1).
struct Clip {
  std::string name;
  int index = 0;
  double duration_s = 0;                                // from 0 to the last key, as the file counts
  double range_s = 0;                                   // first to last key: what is played
  double key_rate_hz = 0;                               // of the file's densest channel
  double rate_hz = 0;                                   // of the frames below: (F - 1) / range_s
  std::vector<std::vector<Eigen::Affine3d>> bone_pose;  // F x B; bone space to world [m], y up
  Eigen::MatrixXd morph_weights;  // K x F [-], of the skin's morphs, over those that its bind pose wears

  int frames() const { return static_cast<int>(bone_pose.size()); }
};

/// A clip with all that it moves.
struct Character {
  Skeleton skeleton;
  SkinnedMesh skin;
  Clip clip;
};

/// Vertices [m], 3 x V, with morph targets put on by their weights, K. No weights: as they are.
Eigen::Matrix3Xd morphed(Eigen::Matrix3Xd vertices, const std::vector<MorphTarget>& morphs,
                         const Eigen::Ref<const Eigen::VectorXd>& weights);

/// The skin at one frame: linear blend skinning of the bind pose, with its morph targets put on by `morph_weights`, K, where
/// there are any. Returns positions [m], 3 x V.
Eigen::Matrix3Xd skin_positions(const Skeleton& skeleton, const SkinnedMesh& skin,
                                const std::vector<Eigen::Affine3d>& bone_pose, const Eigen::VectorXd& morph_weights = {});

/// The same at a frame of the clip.
Eigen::Matrix3Xd skin_positions(const Character& character, Eigen::Index frame);

}  // namespace hydrostat::retarget

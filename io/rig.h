#pragma once

#include <string>
#include <vector>

#include "io/scene.h"
#include "retarget/clip.h"

namespace hydrostat::io {

/// What one of a rig's meshes tells beside place and weights of its vertices, which are turned into the bind pose; see
/// SceneMesh.
struct RigMesh {
  int first_vertex = 0;  // among the vertices of all meshes
  Eigen::Matrix3Xd normals;
  std::vector<Eigen::Matrix2Xd> uvs;
  Eigen::Matrix4Xd colours;
};

/// A scene's skeleton and skin in metres, y up, as bound in the file; the same for all its clips.
struct Rig {
  retarget::Skeleton skeleton;
  std::vector<int> scene_nodes;  // B; the scene node that each bone is
  retarget::SkinnedMesh skin;    // no vertices: the file has a skeleton alone
  Eigen::Affine3d to_ours;       // the file's space to metres, y up: a turn and a scale
  std::vector<RigMesh> meshes;   // that the skin was made of
  Eigen::Matrix3Xi corners;      // 3 x T; of each of the skin's triangles the meshes' vertices that were its corners
  Eigen::VectorXi triangle_materials;  // T; of the scene's, -1 is none
  /// Where the weight of one of the skin's morphs is told.
  struct MorphSource {
    int node, target;  // as a MorphChannel has them
    double at_rest;
  };
  std::vector<MorphSource> morph_sources;  // K
  std::vector<std::string> warnings;
};

/// Merges all skinned meshes by bone and welds them. The bones are those that some skin names, what lies between them and
/// the topmost node that a skin names or a clip moves, and what hangs below a bone with weights and holds no mesh. A bone's
/// bind pose is the inverse of its inverse bind matrix; one without such a matrix stands to the nearest bound bone as at
/// rest. Meshes that were bound in different poses are rebased onto one bind pose; where that is not possible a bone gets a
/// twin of its own bind pose, so that skinning stays exact. Vertices without weights go with the nearest bone. Warnings tell
/// of both. Throws Error (file: `path`) without a skeleton and for singular inverse bind matrices.
Rig build_rig(const Scene& scene, const std::string& path);

/// The bones at a time of the clip, bone space (as in the file) to metres, y up: one per bone of the rig.
std::vector<Eigen::Affine3d> bone_poses(const Rig& rig, const Scene& scene, const SceneClip& clip, double time_s);

/// The weights of the skin's morphs at a time of the clip, over those at rest: K.
Eigen::VectorXd morph_weights(const Rig& rig, const SceneClip& clip, double time_s);

}  // namespace hydrostat::io

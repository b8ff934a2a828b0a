#include "retarget/clip.h"

namespace hydrostat::retarget {

Eigen::Matrix3Xd skin_positions(const Skeleton& skeleton, const SkinnedMesh& skin,
                                const std::vector<Eigen::Affine3d>& bone_pose) {
  std::vector<Eigen::Affine3d> motion(bone_pose.size());
  for (std::size_t b = 0; b < bone_pose.size(); ++b) motion[b] = bone_pose[b] * skeleton.bind_pose[b].inverse();
  Eigen::Matrix3Xd positions = Eigen::Matrix3Xd::Zero(3, skin.vertices.cols());
  for (Eigen::Index v = 0; v < skin.vertices.cols(); ++v) {
    for (const SkinnedMesh::Influence& influence : skin.skin_weights[static_cast<std::size_t>(v)]) {
      positions.col(v) += influence.weight * (motion[static_cast<std::size_t>(influence.bone)] * skin.vertices.col(v));
    }
  }
  return positions;
}

}  // namespace hydrostat::retarget

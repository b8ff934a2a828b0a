#include "retarget/clip.h"

namespace hydrostat::retarget {

Eigen::Matrix3Xd morphed(Eigen::Matrix3Xd vertices, const std::vector<MorphTarget>& morphs,
                         const Eigen::Ref<const Eigen::VectorXd>& weights) {
  for (Eigen::Index k = 0; k < weights.size(); ++k) {
    const MorphTarget& morph = morphs[static_cast<std::size_t>(k)];
    if (weights[k] == 0) continue;
    for (Eigen::Index i = 0; i < morph.vertices.size(); ++i)
      vertices.col(morph.vertices[i]) += weights[k] * morph.offsets.col(i);
  }
  return vertices;
}

Eigen::Matrix3Xd skin_positions(const Skeleton& skeleton, const SkinnedMesh& skin,
                                const std::vector<Eigen::Affine3d>& bone_pose, const Eigen::VectorXd& morph_weights) {
  std::vector<Eigen::Affine3d> motion(bone_pose.size());
  for (std::size_t b = 0; b < bone_pose.size(); ++b) motion[b] = bone_pose[b] * skeleton.bind_pose[b].inverse();
  const Eigen::Matrix3Xd bind_pose = morphed(skin.vertices, skin.morphs, morph_weights);
  Eigen::Matrix3Xd positions = Eigen::Matrix3Xd::Zero(3, bind_pose.cols());
  for (Eigen::Index v = 0; v < bind_pose.cols(); ++v) {
    for (const SkinnedMesh::Influence& influence : skin.skin_weights[static_cast<std::size_t>(v)]) {
      positions.col(v) += influence.weight * (motion[static_cast<std::size_t>(influence.bone)] * bind_pose.col(v));
    }
  }
  return positions;
}

Eigen::Matrix3Xd skin_positions(const Character& character, Eigen::Index frame) {
  const auto& [skeleton, skin, clip] = character;
  const Eigen::VectorXd weights = clip.morph_weights.size() > 0 ? clip.morph_weights.col(frame) : Eigen::VectorXd();
  return skin_positions(skeleton, skin, clip.bone_pose[static_cast<std::size_t>(frame)], weights);
}

}  // namespace hydrostat::retarget

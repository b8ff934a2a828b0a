#include "io/scene_pose.h"

#include <Eigen/SVD>

#include "io/track.h"

namespace hydrostat::io {
namespace {

/// A local transform whose rotation is known by itself, as the ways to inherit scale ask.
struct Local {
  Eigen::Affine3d transform;
  Eigen::Matrix3d rotation;
};

Local at_rest(const Eigen::Affine3d& part) { return {part, split_turn(part.linear()).rotation}; }

/// Translate * rotate * scale. A property without keys stays as the part has it at rest.
Local at_time(const Channel& channel, const Eigen::Affine3d& part, double time_s) {
  const Turn rest = split_turn(part.linear());
  Local local{part, rest.rotation};
  if (!channel.rotation.times.empty()) {
    local.rotation = Eigen::Quaterniond(Eigen::Vector4d(value_at(channel.rotation, time_s))).toRotationMatrix();
  }
  Eigen::Matrix3d stretch = rest.stretch;
  if (!channel.scale.times.empty()) stretch = Eigen::Vector3d(value_at(channel.scale, time_s)).asDiagonal();
  local.transform.linear() = local.rotation * stretch;
  if (!channel.translation.times.empty()) local.transform.translation() = value_at(channel.translation, time_s);
  return local;
}

/// The product of a node's parts.
Local local_transform(const SceneNode& node, const std::vector<const Channel*>& channels, double time_s) {
  Local local{Eigen::Affine3d::Identity(), Eigen::Matrix3d::Identity()};
  for (std::size_t p = 0; p < node.parts.size(); ++p) {
    const Local part = channels[p] ? at_time(*channels[p], node.parts[p], time_s) : at_rest(node.parts[p]);
    local.transform = local.transform * part.transform;
    local.rotation = local.rotation * part.rotation;
  }
  return local;
}

/// A node's transform to the scene; beside it what its children need of it.
struct Pose {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d local_stretch = Eigen::Matrix3d::Identity();
};

Pose join(const Pose& parent, const Local& local, ScaleInheritance inheritance) {
  Pose pose;
  pose.rotation = parent.rotation * local.rotation;
  pose.local_stretch = local.rotation.transpose() * local.transform.linear();
  pose.transform = parent.transform * local.transform;
  if (inheritance == ScaleInheritance::kOrdinary) return pose;
  Eigen::Matrix3d stretch = parent.rotation.transpose() * parent.transform.linear();
  if (inheritance == ScaleInheritance::kCompensated) {
    // A parent of zero scale leaves nothing to make good.
    const Eigen::FullPivLU<Eigen::Matrix3d> own(parent.local_stretch);
    if (own.isInvertible()) stretch = stretch * own.inverse();
  }
  pose.transform.linear() = pose.rotation * stretch * pose.local_stretch;
  return pose;
}

}  // namespace

Turn split_turn(const Eigen::Matrix3d& linear) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (rotation.determinant() < 0) rotation = -rotation;
  return {rotation, rotation.transpose() * linear};
}

std::vector<Eigen::Affine3d> node_poses(const Scene& scene, const SceneClip* clip, double time_s) {
  std::vector<std::vector<const Channel*>> channels;
  for (const SceneNode& node : scene.nodes) channels.emplace_back(node.parts.size(), nullptr);
  if (clip) {
    for (const Channel& channel : clip->channels) {
      channels[static_cast<std::size_t>(channel.node)][static_cast<std::size_t>(channel.part)] = &channel;
    }
  }
  std::vector<Pose> poses(scene.nodes.size());
  std::vector<Eigen::Affine3d> transforms(scene.nodes.size());
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    const SceneNode& node = scene.nodes[n];
    const Pose parent = node.parent < 0 ? Pose{} : poses[static_cast<std::size_t>(node.parent)];
    poses[n] = join(parent, local_transform(node, channels[n], time_s), node.inheritance);
    transforms[n] = poses[n].transform;
  }
  return transforms;
}

}  // namespace hydrostat::io

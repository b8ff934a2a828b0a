#include "io/played_skin.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "retarget/best_fit_rotation.h"

namespace hydrostat::io {
namespace {

constexpr double kAtFrame = 1e-6;  // of the time between two frames

/// Normals of the vertices, 3 x V: the mean of the triangles around, weighted by area; up where a vertex has none.
Eigen::Matrix3Xd vertex_normals(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    const Eigen::Vector3i corner = triangles.col(t);
    const Eigen::Vector3d a = vertices.col(corner[0]);
    const Eigen::Vector3d twice_area = (vertices.col(corner[1]) - a).cross(vertices.col(corner[2]) - a);
    for (int k : corner) normals.col(k) += twice_area;
  }
  for (Eigen::Index v = 0; v < normals.cols(); ++v) {
    const double length = normals.col(v).norm();
    normals.col(v) = length > 0 ? Eigen::Vector3d(normals.col(v) / length) : Eigen::Vector3d::UnitY();
  }
  return normals;
}

/// A loop with its first frame, moved on by one period, as last; any other motion as it is.
retarget::Motion with_closing_frame(const retarget::Motion& motion) {
  if (!motion.loop || motion.count() == 0) return motion;
  retarget::Motion closed = motion;
  closed.loop = false;
  closed.frames.conservativeResize(Eigen::NoChange, motion.count() + 1);
  closed.at(motion.count()) = retarget::after_cycles(motion, 1) * Eigen::Matrix3Xd(motion.at(0));
  return closed;
}

Eigen::Matrix3Xd embedded(const retarget::Embedding& embedding, const Eigen::Ref<const Eigen::Matrix3Xd>& nodes) {
  Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Zero(3, embedding.nodes.cols());
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    for (int k = 0; k < 4; ++k) vertices.col(v) += embedding.weights(k, v) * nodes.col(embedding.nodes(k, v));
  }
  return vertices;
}

}  // namespace

std::vector<Appearance::Part> parts_of(const EmbeddedSkin& skin) {
  if (skin.appearance != nullptr && !skin.appearance->parts.empty()) return skin.appearance->parts;
  Appearance::Part whole;
  whole.vertices = Eigen::VectorXi::LinSpaced(skin.vertices.cols(), 0, static_cast<int>(skin.vertices.cols()) - 1);
  whole.triangles = skin.triangles;
  whole.normals = vertex_normals(skin.vertices, skin.triangles);
  return {whole};
}

PlayedSkin::PlayedSkin(const EmbeddedSkin& skin, const retarget::ControlMesh& body,
                       const Eigen::Ref<const Eigen::VectorXd>& mass, const retarget::Motion& motion)
    : embedding_(skin.embedding),
      bind_nodes_(body.nodes),
      motion_(with_closing_frame(motion)),
      turns_(retarget::best_fit_rotations(body.nodes, motion_, mass)) {
  assert(motion.count() > 0 && motion.frames.rows() == 3 * body.nodes.cols() && mass.size() == body.nodes.cols());
  assert(skin.embedding.nodes.cols() == skin.vertices.cols());
  if (skin.morphs != nullptr) morphs_ = play_morphs(*skin.morphs, skin.embedding, body, motion_, turns_);
  missed_ = skin.vertices - carried_in_bind_pose();
}

Eigen::Matrix3Xd PlayedSkin::carried_in_bind_pose() const { return embedded(embedding_, bind_nodes_); }

Eigen::Matrix3Xd PlayedSkin::carried_at(Eigen::Index frame) const {
  const bool is_bare = morphs_.shapes.empty();
  return carried(motion_.at(frame), turns_[static_cast<std::size_t>(frame)],
                 is_bare ? Eigen::VectorXd() : Eigen::VectorXd(morphs_.weights.col(frame)));
}

Eigen::Matrix3Xd PlayedSkin::carried(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const Eigen::Quaterniond& turn,
                                     const Eigen::VectorXd& weights) const {
  Eigen::Matrix3Xd vertices = embedded(embedding_, nodes);
  const Eigen::Matrix3d rotation = turn.toRotationMatrix();
  for (std::size_t k = 0; k < morphs_.shapes.size(); ++k)
    vertices += weights[static_cast<Eigen::Index>(k)] * (rotation * morphs_.shapes[k]);
  return vertices;
}

PlayedSkin::Pose PlayedSkin::at(double time_s) const {
  const double frame = std::clamp(time_s * motion_.rate_hz, 0.0, static_cast<double>(motion_.count() - 1));
  const auto before = static_cast<Eigen::Index>(frame + kAtFrame);
  const double share = frame - static_cast<double>(before);
  Pose pose;
  pose.turn = turns_[static_cast<std::size_t>(before)];
  if (share <= kAtFrame) {
    pose.vertices = carried_at(before);
  } else {
    const Eigen::Index after = before + 1;
    const Eigen::Matrix3Xd nodes = (1 - share) * motion_.at(before) + share * motion_.at(after);
    Eigen::VectorXd weights;
    if (!morphs_.shapes.empty()) weights = (1 - share) * morphs_.weights.col(before) + share * morphs_.weights.col(after);
    pose.turn = pose.turn.slerp(share, turns_[static_cast<std::size_t>(after)]);
    pose.vertices = carried(nodes, pose.turn, weights);
  }
  pose.vertices += pose.turn.toRotationMatrix() * missed_;
  return pose;
}

}  // namespace hydrostat::io

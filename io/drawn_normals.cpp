#include "io/drawn_normals.h"

#include <array>
#include <cmath>
#include <map>

namespace hydrostat::io {
namespace {

/// `vector` turned by the shortest turn that takes the unit vector `from` to the unit vector `to`; by half a turn about any
/// axis across where they are opposite.
Eigen::Vector3d turned(const Eigen::Vector3d& vector, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const double cosine = from.dot(to);
  if (cosine < -1 + 1e-12) {
    const Eigen::Vector3d axis = from.unitOrthogonal();
    return 2 * axis.dot(vector) * axis - vector;
  }
  const Eigen::Vector3d axis = from.cross(to), across = axis.cross(vector);
  return vector + across + axis.cross(across) / (1 + cosine);
}

}  // namespace

DrawnNormals::DrawnNormals(const std::vector<Appearance::Part>& parts, const Eigen::Matrix3Xd& bind_pose) {
  std::map<std::array<long, 4>, int> numbers;
  for (const Appearance::Part& part : parts) {
    Eigen::VectorXi mine(part.normals.cols());  // none of a flat part
    for (Eigen::Index d = 0; d < mine.size(); ++d) {
      std::array<long, 4> key{part.vertices[d], 0, 0, 0};
      for (int axis = 0; axis < 3; ++axis)
        key[static_cast<std::size_t>(axis) + 1] = std::lround(1000 * part.normals(axis, d));
      const auto [place, is_new] = numbers.try_emplace(key, static_cast<int>(bind_.size()));
      if (is_new) bind_.emplace_back(part.normals.col(d));
      mine[d] = place->second;
    }
    for (const auto corners : part.triangles.colwise()) {
      for (int k = 0; k < 3 && mine.size() > 0; ++k) corners_.emplace_back(part.vertices[corners[k]], mine[corners[k]]);
    }
    of_parts_.push_back(std::move(mine));
  }
  surface_bind_ = of_surface(bind_pose);
}

std::vector<Eigen::Matrix3Xd> DrawnNormals::by_part(const Eigen::VectorXd& vectors) const {
  std::vector<Eigen::Matrix3Xd> result;
  for (const Eigen::VectorXi& mine : of_parts_) {
    Eigen::Matrix3Xd own(3, mine.size());
    for (Eigen::Index d = 0; d < mine.size(); ++d) own.col(d) = vectors.segment<3>(3 * mine[d]);
    result.push_back(std::move(own));
  }
  return result;
}

Eigen::VectorXd DrawnNormals::offsets(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& turn) const {
  const Eigen::Matrix3Xd now = turn.conjugate().toRotationMatrix() * of_surface(vertices);
  Eigen::VectorXd result(3 * count());
  for (Eigen::Index n = 0; n < count(); ++n) {
    const Eigen::Vector3d& bind = bind_[static_cast<std::size_t>(n)];
    result.segment<3>(3 * n) = turned(bind, surface_bind_.col(n), now.col(n)) - bind;
  }
  return result;
}

Eigen::Matrix3Xd DrawnNormals::at(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& turn) const {
  Eigen::Matrix3Xd normals = offsets(vertices, turn).reshaped(3, count());
  for (Eigen::Index n = 0; n < count(); ++n) normals.col(n) += bind_[static_cast<std::size_t>(n)];
  return turn.toRotationMatrix() * normals.colwise().normalized();
}

Eigen::Matrix3Xd DrawnNormals::of_surface(const Eigen::Matrix3Xd& vertices) const {
  Eigen::Matrix3Xd sums = Eigen::Matrix3Xd::Zero(3, count());
  for (std::size_t c = 0; c < corners_.size(); c += 3) {
    const Eigen::Vector3d a = vertices.col(corners_[c].first);
    const Eigen::Vector3d area = (vertices.col(corners_[c + 1].first) - a).cross(vertices.col(corners_[c + 2].first) - a);
    for (std::size_t k = c; k < c + 3; ++k) sums.col(corners_[k].second) += area;
  }
  for (Eigen::Index n = 0; n < count(); ++n) {
    const double size = sums.col(n).norm();
    if (size > 0) sums.col(n) /= size;
    if (!(size > 0)) sums.col(n) = bind_[static_cast<std::size_t>(n)];
  }
  return sums;
}

}  // namespace hydrostat::io

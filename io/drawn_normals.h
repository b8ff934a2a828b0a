#pragma once

#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "io/appearance.h"

namespace hydrostat::io {

/// The normals of a skin's drawn vertices, each once however many share it: drawn vertices of one place that share a normal
/// in the bind pose go on sharing it. Flat parts have none.
class DrawnNormals {
 public:
  /// bind_pose: [m] 3 x V.
  DrawnNormals(const std::vector<Appearance::Part>& parts, const Eigen::Matrix3Xd& bind_pose);

  Eigen::Index count() const { return static_cast<Eigen::Index>(bind_.size()); }
  /// Of each part's drawn vertices which normal is theirs, D each; none of a flat part.
  const std::vector<Eigen::VectorXi>& of_parts() const { return of_parts_; }

  /// Vectors x y z by normal as those of each part's drawn vertices, 3 x D each.
  std::vector<Eigen::Matrix3Xd> by_part(const Eigen::VectorXd& vectors) const;

  /// Offsets from the bind pose's normals, x y z by normal, when the skin lies at `vertices` and `turn` is taken out: those
  /// of the moved surface (the mean of the triangles around, weighted by area). What the clip file's normals are off the
  /// surface's in the bind pose they stay.
  Eigen::VectorXd offsets(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& turn) const;

  /// The normals themselves, of length 1, when the skin lies at `vertices` and turned as a whole by `turn`. 3 x count.
  Eigen::Matrix3Xd at(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& turn) const;

 private:
  Eigen::Matrix3Xd of_surface(const Eigen::Matrix3Xd& vertices) const;

  std::vector<Eigen::Vector3d> bind_;
  std::vector<Eigen::VectorXi> of_parts_;
  std::vector<std::pair<int, int>> corners_;  // vertex of the skin and normal, three a triangle
  Eigen::Matrix3Xd surface_bind_;
};

}  // namespace hydrostat::io

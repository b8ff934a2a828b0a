#include "io/moving_normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "io/principal_directions.h"

namespace hydrostat::io {
namespace {

constexpr Eigen::Index kMostTargets = 8;  // that every reader of glTF is asked to know
constexpr Eigen::Index kSamples = 64;     // frames that the targets are fitted to
constexpr double kEnough = 0.035;         // [rad] RMS

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

/// The normals of the drawn vertices, each once however many share it.
class Normals {
 public:
  Normals(const std::vector<Appearance::Part>& parts, const Eigen::Matrix3Xd& bind_pose) {
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

  Eigen::Index count() const { return static_cast<Eigen::Index>(bind_.size()); }

  /// Vectors x y z by normal as those of each part's drawn vertices, 3 x D each.
  std::vector<Eigen::Matrix3Xd> by_part(const Eigen::VectorXd& vectors) const {
    std::vector<Eigen::Matrix3Xd> result;
    for (const Eigen::VectorXi& mine : of_parts_) {
      Eigen::Matrix3Xd own(3, mine.size());
      for (Eigen::Index d = 0; d < mine.size(); ++d) own.col(d) = vectors.segment<3>(3 * mine[d]);
      result.push_back(std::move(own));
    }
    return result;
  }

  /// Offsets from the bind pose's normals, x y z by normal, when the skin lies at `vertices` and `turn` is taken out. What
  /// the clip file's normals are off the surface's in the bind pose they stay.
  Eigen::VectorXd offsets(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& turn) const {
    const Eigen::Matrix3Xd now = turn.conjugate().toRotationMatrix() * of_surface(vertices);
    Eigen::VectorXd result(3 * count());
    for (Eigen::Index n = 0; n < count(); ++n) {
      const Eigen::Vector3d& bind = bind_[static_cast<std::size_t>(n)];
      result.segment<3>(3 * n) = turned(bind, surface_bind_.col(n), now.col(n)) - bind;
    }
    return result;
  }

 private:
  Eigen::Matrix3Xd of_surface(const Eigen::Matrix3Xd& vertices) const {
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

  std::vector<Eigen::Vector3d> bind_;
  std::vector<Eigen::VectorXi> of_parts_;     // of each drawn vertex its normal
  std::vector<std::pair<int, int>> corners_;  // vertex of the skin and normal, three a triangle
  Eigen::Matrix3Xd surface_bind_;
};

}  // namespace

MovingNormals fit_normals(const std::vector<Appearance::Part>& parts, const SkinCourse& skin,
                          const std::vector<Eigen::Quaterniond>& turns, const std::vector<Eigen::Matrix3Xd>& shapes,
                          const Eigen::MatrixXd& shape_weights) {
  MovingNormals result;
  const Normals normals(parts, skin.bind_pose);
  if (normals.count() == 0) return result;
  Eigen::MatrixXd of_shapes(3 * normals.count(), static_cast<Eigen::Index>(shapes.size()));
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    of_shapes.col(static_cast<Eigen::Index>(k)) =
        normals.offsets(skin.bind_pose + shapes[k], Eigen::Quaterniond::Identity());
    result.of_shapes.push_back(normals.by_part(of_shapes.col(static_cast<Eigen::Index>(k))));
  }
  const auto offsets_at = [&](Eigen::Index f) {
    Eigen::VectorXd offsets = normals.offsets(skin.at(f), turns[static_cast<std::size_t>(f)]);
    if (!shapes.empty()) offsets -= of_shapes * shape_weights.col(f);
    return offsets;
  };
  const Eigen::Index frames = skin.frames, samples = std::min(frames, kSamples);
  Eigen::MatrixXd sampled(3 * normals.count(), samples);
  for (Eigen::Index s = 0; s < samples; ++s) sampled.col(s) = offsets_at(samples > 1 ? s * (frames - 1) / (samples - 1) : 0);
  const double enough = kEnough * kEnough * static_cast<double>(samples * normals.count());
  const Eigen::MatrixXd directions = principal_directions(sampled, enough, kMostTargets);
  if (directions.cols() == 0) return result;
  result.weights.resize(directions.cols(), frames);
  for (Eigen::Index f = 0; f < frames; ++f) result.weights.col(f) = directions.transpose() * offsets_at(f);
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    const double largest = std::max(result.weights.row(k).cwiseAbs().maxCoeff(), 1e-12);
    result.weights.row(k) /= largest;
    result.targets.push_back(normals.by_part(largest * directions.col(k)));
  }
  return result;
}

}  // namespace hydrostat::io

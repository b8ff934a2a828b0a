#include "io/moving_normals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace hydrostat::io {
namespace {

constexpr Eigen::Index kMostTargets = 8;  // that every reader of glTF is asked to know
constexpr Eigen::Index kSamples = 64;     // frames that the targets are fitted to
constexpr double kEnough = 0.035;         // [rad] RMS

/// The normals of the drawn vertices, each once however many share it.
class Normals {
 public:
  Normals(const std::vector<Appearance::Part>& parts, const Eigen::Matrix3Xd& bind_pose) {
    std::map<std::array<long, 4>, int> numbers;
    for (const Appearance::Part& part : parts) {
      Eigen::VectorXi mine(part.vertices.size());
      for (Eigen::Index d = 0; d < mine.size(); ++d) {
        std::array<long, 4> key{part.vertices[d], 0, 0, 0};
        for (int axis = 0; axis < 3; ++axis)
          key[static_cast<std::size_t>(axis) + 1] = std::lround(1000 * part.normals(axis, d));
        const auto [place, is_new] = numbers.try_emplace(key, static_cast<int>(bind_.size()));
        if (is_new) bind_.emplace_back(part.normals.col(d));
        mine[d] = place->second;
      }
      for (const auto corners : part.triangles.colwise()) {
        for (int k = 0; k < 3; ++k) corners_.emplace_back(part.vertices[corners[k]], mine[corners[k]]);
      }
      of_parts_.push_back(std::move(mine));
    }
    surface_bind_ = of_surface(bind_pose);
  }

  Eigen::Index count() const { return static_cast<Eigen::Index>(bind_.size()); }
  const std::vector<Eigen::VectorXi>& of_parts() const { return of_parts_; }

  /// Offsets from the bind pose's normals, x y z by normal, when the skin lies at `vertices` and `turn` is taken out. What
  /// the clip file's normals are off the surface's in the bind pose they stay.
  Eigen::VectorXd offsets(const Eigen::Matrix3Xd& vertices, const Eigen::Quaterniond& turn) const {
    const Eigen::Matrix3Xd now = turn.conjugate().toRotationMatrix() * of_surface(vertices);
    Eigen::VectorXd result(3 * count());
    for (Eigen::Index n = 0; n < count(); ++n) {
      const Eigen::Vector3d& bind = bind_[static_cast<std::size_t>(n)];
      result.segment<3>(3 * n) =
          Eigen::Quaterniond::FromTwoVectors(surface_bind_.col(n), now.col(n)).toRotationMatrix() * bind - bind;
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

Eigen::Matrix3Xd skin_at(const retarget::Embedding& embedding, const Eigen::Ref<const Eigen::Matrix3Xd>& nodes) {
  Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Zero(3, embedding.nodes.cols());
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    for (int k = 0; k < 4; ++k) vertices.col(v) += embedding.weights(k, v) * nodes.col(embedding.nodes(k, v));
  }
  return vertices;
}

/// Directions (orthonormal columns) that hold most of the columns of `samples`.
Eigen::MatrixXd principal_directions(const Eigen::MatrixXd& samples, double enough) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(samples.transpose() * samples);  // small: one row a sample
  const Eigen::Index most = std::min(kMostTargets, samples.cols());
  double left = std::max(0.0, solver.eigenvalues().sum());
  Eigen::Index kept = 0;
  while (kept < most && left > enough) left -= solver.eigenvalues()[samples.cols() - 1 - kept++];
  Eigen::MatrixXd directions(samples.rows(), kept);
  for (Eigen::Index k = 0; k < kept; ++k)
    directions.col(k) = (samples * solver.eigenvectors().col(samples.cols() - 1 - k)).normalized();
  return directions;
}

}  // namespace

MovingNormals fit_normals(const std::vector<Appearance::Part>& parts, const Eigen::Matrix3Xd& rest_nodes,
                          const retarget::Embedding& embedding, const retarget::Motion& motion,
                          const std::vector<Eigen::Quaterniond>& turns) {
  MovingNormals result;
  for (const Appearance::Part& part : parts) {
    if (part.normals.cols() == 0) return result;
  }
  const Normals normals(parts, skin_at(embedding, rest_nodes));
  const auto offsets_at = [&](Eigen::Index f) {
    return normals.offsets(skin_at(embedding, motion.at(f)), turns[static_cast<std::size_t>(f)]);
  };
  const Eigen::Index frames = motion.count(), samples = std::min(frames, kSamples);
  Eigen::MatrixXd sampled(3 * normals.count(), samples);
  for (Eigen::Index s = 0; s < samples; ++s) sampled.col(s) = offsets_at(samples > 1 ? s * (frames - 1) / (samples - 1) : 0);
  const double enough = kEnough * kEnough * static_cast<double>(samples * normals.count());
  const Eigen::MatrixXd directions = principal_directions(sampled, enough);
  if (directions.cols() == 0) return result;
  result.weights.resize(directions.cols(), frames);
  for (Eigen::Index f = 0; f < frames; ++f) result.weights.col(f) = directions.transpose() * offsets_at(f);
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    const double largest = std::max(result.weights.row(k).cwiseAbs().maxCoeff(), 1e-12);
    result.weights.row(k) /= largest;
    std::vector<Eigen::Matrix3Xd>& target = result.targets.emplace_back();
    for (const Eigen::VectorXi& mine : normals.of_parts()) {
      Eigen::Matrix3Xd offsets(3, mine.size());
      for (Eigen::Index d = 0; d < mine.size(); ++d) offsets.col(d) = largest * directions.col(k).segment<3>(3 * mine[d]);
      target.push_back(std::move(offsets));
    }
  }
  return result;
}

}  // namespace hydrostat::io

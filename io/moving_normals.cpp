#include "io/moving_normals.h"

#include <algorithm>

#include "io/drawn_normals.h"
#include "io/principal_directions.h"

namespace hydrostat::io {
namespace {

constexpr Eigen::Index kMostTargets = 8;     // that every reader of glTF is asked to know
constexpr Eigen::Index kNormalSamples = 64;  // frames that the targets are fitted to
constexpr double kNormalsEnough = 0.035;     // [rad] RMS

}  // namespace

MovingNormals fit_normals(const std::vector<Appearance::Part>& parts, const SkinCourse& skin,
                          const std::vector<Eigen::Quaterniond>& turns, const std::vector<Eigen::Matrix3Xd>& shapes,
                          const Eigen::MatrixXd& shape_weights) {
  MovingNormals result;
  const DrawnNormals normals(parts, skin.bind_pose);
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
  const Eigen::Index frames = skin.frames, samples = std::min(frames, kNormalSamples);
  Eigen::MatrixXd sampled(3 * normals.count(), samples);
  for (Eigen::Index s = 0; s < samples; ++s) sampled.col(s) = offsets_at(samples > 1 ? s * (frames - 1) / (samples - 1) : 0);
  const double enough = kNormalsEnough * kNormalsEnough * static_cast<double>(samples * normals.count());
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

#include "retarget/mesh_places.h"

#include <algorithm>

namespace hydrostat::retarget {
namespace {

constexpr double kOtherLimb = 0.5;  // share of weights on other bones from which on a place is another limb's

}  // namespace

Places locate(const ControlMesh& mesh, const Eigen::MatrixXd& bone_weights, const Eigen::Matrix3Xd& points,
              const Eigen::MatrixXd& bones) {
  const Eigen::Index tets = mesh.tets.cols();
  std::vector<Eigen::Matrix3d> inverse(static_cast<std::size_t>(tets));
  Eigen::MatrixXd owners(bone_weights.rows(), tets);
  for (Eigen::Index t = 0; t < tets; ++t) {
    Eigen::Matrix3d spans;
    for (int k = 0; k < 3; ++k) spans.col(k) = mesh.nodes.col(mesh.tets(k + 1, t)) - mesh.nodes.col(mesh.tets(0, t));
    inverse[static_cast<std::size_t>(t)] = spans.inverse();
    owners.col(t) = 0.25 * bone_weights(Eigen::all, mesh.tets.col(t)).rowwise().sum();
  }
  Places places{Eigen::Matrix4Xi(4, points.cols()), Eigen::Matrix4Xd(4, points.cols()),
                std::vector<char>(static_cast<std::size_t>(points.cols()), 0)};
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    double best = 1e300;
    for (Eigen::Index t = 0; t < tets; ++t) {
      Eigen::Vector4d weights;
      weights.tail<3>() = inverse[static_cast<std::size_t>(t)] * (points.col(p) - mesh.nodes.col(mesh.tets(0, t)));
      weights[0] = 1 - weights.tail<3>().sum();
      const double outside = std::max(0.0, -weights.minCoeff() - 1e-9);
      if (outside >= best) continue;
      const double foreign = 0.5 * (owners.col(t) - bones.col(p)).lpNorm<1>();
      const double cost = outside + std::max(0.0, foreign - kOtherLimb) + 1e-3 * foreign;
      if (cost >= best) continue;
      best = cost;
      places.nodes.col(p) = mesh.tets.col(t);
      places.weights.col(p) = weights.cwiseMax(0) / weights.cwiseMax(0).sum();
      places.is_inside[static_cast<std::size_t>(p)] = outside == 0;
    }
  }
  return places;
}

}  // namespace hydrostat::retarget

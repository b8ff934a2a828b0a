#include "retarget/spread_bone_weights.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <vector>

namespace hydrostat::retarget {

Eigen::MatrixXd spread_bone_weights(const Skeleton& skeleton, const SkinnedMesh& skin, const BodyVoxels& body,
                                    const BodyParts& parts, const BodyCells& cells, const ControlMesh& mesh) {
  constexpr double kNeighbours = 0.02;  // strength of an edge over the mean strength of the samples at a node
  std::vector<Eigen::Vector3d> points;
  std::vector<int> point_cells, point_voxels;
  for (int v = 0; v < body.voxels.count(); ++v) {
    const SkinSample& sample = at(body.sample, v);
    if (sample.triangle == kNone || at(parts.part_of, v) == kNone || at(cells.cell_of_part, at(parts.part_of, v)) == kNone)
      continue;
    points.push_back(skin.vertices(Eigen::all, skin.triangles.col(sample.triangle)) * sample.shares);
    point_cells.push_back(at(cells.cell_of_part, at(parts.part_of, v)));
    point_voxels.push_back(v);
  }
  const Embedding embedding =
      embed(mesh, Eigen::Map<const Eigen::Matrix3Xd>(points.front().data(), 3, static_cast<Eigen::Index>(points.size())),
            Eigen::Map<const Eigen::VectorXi>(point_cells.data(), static_cast<Eigen::Index>(point_cells.size())));
  Eigen::VectorXd strength = Eigen::VectorXd::Zero(mesh.node_count());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(mesh.node_count(), skeleton.count());
  for (Eigen::Index p = 0; p < embedding.count(); ++p) {
    for (int k = 0; k < 4; ++k) {
      const double pull = embedding.weights(k, p) * embedding.weights(k, p);
      strength[embedding.nodes(k, p)] += pull;
      for (const auto& [bone, weight] : weights_at(skin, at(body.sample, at(point_voxels, static_cast<int>(p)))))
        sum(embedding.nodes(k, p), bone) += pull * weight;
    }
  }
  const double edge_strength = kNeighbours * strength.mean();
  std::vector<Eigen::Triplet<double>> entries;
  for (int n = 0; n < mesh.node_count(); ++n) entries.emplace_back(n, n, strength[n]);
  for (const auto edge : mesh.edges.colwise()) {
    entries.emplace_back(edge[0], edge[0], edge_strength);
    entries.emplace_back(edge[1], edge[1], edge_strength);
    entries.emplace_back(edge[0], edge[1], -edge_strength);
    entries.emplace_back(edge[1], edge[0], -edge_strength);
  }
  Eigen::SparseMatrix<double> system(mesh.node_count(), mesh.node_count());
  system.setFromTriplets(entries.begin(), entries.end());
  Eigen::MatrixXd weights = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(system).solve(sum).transpose();
  constexpr double kRounding = 1e-6;
  weights = (weights.array() < kRounding).select(0, weights);
  return weights.array().rowwise() / weights.colwise().sum().array();
}

}  // namespace hydrostat::retarget

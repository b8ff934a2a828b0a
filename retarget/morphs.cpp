#include "retarget/morphs.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>

#include "retarget/best_fit_rotation.h"

namespace hydrostat::retarget {
namespace {

constexpr double kUnseenMorph = 1e-3;  // of a target's largest offset: less is nothing
constexpr double kEvenMorph = 0.01;    // of an edge, over what the vertices weigh at a node

}  // namespace

Eigen::VectorXd MovingMorphs::at(double time_s) const {
  const Eigen::Index frames = weights.cols();
  const double last = static_cast<double>(frames - (loop ? 0 : 1));
  double place = time_s * rate_hz;
  place = loop ? place - last * std::floor(place / last) : std::min(place, last);
  const auto frame = std::min(static_cast<Eigen::Index>(place), frames - 1);
  const Eigen::Index next = loop ? (frame + 1) % frames : std::min(frame + 1, frames - 1);
  return weights.col(frame) + (place - static_cast<double>(frame)) * (weights.col(next) - weights.col(frame));
}

std::vector<Eigen::Matrix3Xd> carried_by_nodes(const std::vector<MorphTarget>& morphs, const ControlMesh& mesh,
                                               const Embedding& skin_embedding) {
  if (morphs.empty()) return {};
  const Eigen::Index count = mesh.nodes.cols();
  std::vector<Eigen::Triplet<double>> entries;
  double trace = 0;
  for (Eigen::Index v = 0; v < skin_embedding.nodes.cols(); ++v) {
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b)
        entries.emplace_back(skin_embedding.nodes(a, v), skin_embedding.nodes(b, v),
                             skin_embedding.weights(a, v) * skin_embedding.weights(b, v));
      trace += skin_embedding.weights(a, v) * skin_embedding.weights(a, v);
    }
  }
  const double evenness = kEvenMorph * trace / static_cast<double>(count);
  for (const auto edge : mesh.edges.colwise()) {
    for (const auto& [a, b] : {std::pair(edge[0], edge[1]), std::pair(edge[1], edge[0])}) {
      entries.emplace_back(a, a, evenness);
      entries.emplace_back(a, b, -evenness);
    }
  }
  Eigen::SparseMatrix<double> normal(count, count);
  normal.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
  std::vector<Eigen::Matrix3Xd> carried;
  for (const MorphTarget& morph : morphs) {
    Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(count, 3);
    for (Eigen::Index i = 0; i < morph.vertices.size(); ++i) {
      const int v = morph.vertices[i];
      for (int k = 0; k < 4; ++k)
        sums.row(skin_embedding.nodes(k, v)) += skin_embedding.weights(k, v) * morph.offsets.col(i).transpose();
    }
    carried.emplace_back(Eigen::MatrixX3d(solver.solve(sums)).transpose());
  }
  return carried;
}

std::vector<MorphTarget> left_by_nodes(const std::vector<MorphTarget>& morphs, const std::vector<Eigen::Matrix3Xd>& carried,
                                       const Embedding& skin_embedding) {
  if (carried.empty()) return morphs;
  std::vector<MorphTarget> left = morphs;
  for (std::size_t k = 0; k < left.size(); ++k) {
    Eigen::Matrix3Xd offsets = -embedded_positions(skin_embedding, carried[k]);
    for (Eigen::Index i = 0; i < morphs[k].vertices.size(); ++i)
      offsets.col(morphs[k].vertices[i]) += morphs[k].offsets.col(i);
    const double least = kUnseenMorph * morphs[k].offsets.colwise().norm().maxCoeff();
    std::vector<int> moved;
    for (int v = 0; v < offsets.cols(); ++v) {
      if (offsets.col(v).norm() > least) moved.push_back(v);
    }
    left[k].vertices = Eigen::Map<const Eigen::VectorXi>(moved.data(), static_cast<Eigen::Index>(moved.size()));
    left[k].offsets = offsets(Eigen::all, moved);
  }
  return left;
}

Eigen::MatrixXd closed_weights(const Eigen::MatrixXd& clip_weights, const Motion& motion) {
  const Eigen::Index frames = motion.count();
  if (!motion.loop || clip_weights.cols() <= frames) return clip_weights;
  Eigen::MatrixXd closed = clip_weights.leftCols(frames);
  const Eigen::VectorXd defect = clip_weights.col(frames) - clip_weights.col(0);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const double share = static_cast<double>(f) / static_cast<double>(frames);
    closed.col(f) += (share < 0.5 ? 0.5 : -0.5) * std::pow(std::cos(M_PI * share), 2) * defect;
  }
  return closed;
}

NodeTurns::NodeTurns(const ControlMesh& mesh, std::vector<int> nodes) : bind_pose_(mesh.nodes) {
  std::vector<std::vector<int>> around(static_cast<std::size_t>(mesh.nodes.cols()));
  const auto join = [&](int a, int b) { around[static_cast<std::size_t>(a)].push_back(b); };
  for (int e = 0; mesh.tets.cols() == 0 && e < mesh.edges.cols(); ++e) {
    join(mesh.edges(0, e), mesh.edges(1, e));
    join(mesh.edges(1, e), mesh.edges(0, e));
  }
  for (const auto tet : mesh.tets.colwise()) {
    for (const int node : tet) {
      for (const int other : tet) {
        if (other != node) join(node, other);
      }
    }
  }
  for (const int node : nodes) {
    std::vector<int>& star = around[static_cast<std::size_t>(node)];
    std::sort(star.begin(), star.end());
    star.erase(std::unique(star.begin(), star.end()), star.end());
    stars_.push_back(star);
    stars_.back().push_back(node);
  }
}

std::vector<Eigen::Quaterniond> NodeTurns::at(const Eigen::Ref<const Eigen::Matrix3Xd>& positions,
                                              const Eigen::Quaterniond& otherwise) const {
  std::vector<Eigen::Quaterniond> turns;
  for (const std::vector<int>& star : stars_) {
    turns.push_back(otherwise);
    if (star.size() < 4) continue;
    const Eigen::Matrix3Xd rest = bind_pose_(Eigen::all, star), now = positions(Eigen::all, star);
    turns.back() = best_fit_rotation(rest, now, Eigen::VectorXd::Ones(rest.cols()));
  }
  return turns;
}

}  // namespace hydrostat::retarget

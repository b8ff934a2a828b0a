#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <vector>

#include "retarget/control_mesh.h"
#include "retarget/limbs.h"

namespace hydrostat::retarget {
namespace {

Eigen::Vector4d barycentric(const ControlMesh& mesh, Eigen::Index tet, const Eigen::Vector3d& point) {
  Eigen::Matrix4d corners;
  for (int k = 0; k < 4; ++k) corners.col(k) << mesh.nodes.col(mesh.tets(k, tet)), 1.0;
  return corners.partialPivLu().solve(point.homogeneous());
}

}  // namespace

Embedding embed(const ControlMesh& mesh, const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                const Eigen::Ref<const Eigen::VectorXi>& cells) {
  Embedding embedding{Eigen::VectorXi(points.cols()), Eigen::Matrix4Xi(4, points.cols()),
                      Eigen::Matrix4Xd(4, points.cols())};
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    const Eigen::Vector3d low = mesh.origin + mesh.cell_size.cwiseProduct(mesh.cell_places.col(cells[p]).cast<double>());
    const Eigen::Vector3d held = points.col(p).cwiseMax(low).cwiseMin(low + mesh.cell_size);
    embedding.max_miss = std::max(embedding.max_miss, (held - points.col(p)).norm());
    double deepest = -1e300;
    for (int tet = 5 * cells[p]; tet < 5 * cells[p] + 5; ++tet) {
      const Eigen::Vector4d weights = barycentric(mesh, tet, held);
      if (weights.minCoeff() <= deepest) continue;
      deepest = weights.minCoeff();
      embedding.tets[p] = tet;
      embedding.nodes.col(p) = mesh.tets.col(tet);
      embedding.weights.col(p) =
          weights.cwiseMax(0) / weights.cwiseMax(0).sum();  // rounding alone: the five tets fill the cell
    }
  }
  return embedding;
}

Embedding embed_skin(const ControlMesh& mesh, const SkinnedMesh& skin) {
  return embed(mesh, skin.vertices, mesh.vertex_cells);
}

ContactPoints contact_points(const ControlMesh& mesh, const Skeleton& skeleton, const SkinnedMesh& skin, bool symmetric) {
  constexpr double kSpacing = 0.35;       // cells
  constexpr double kImageSpacing = 0.01;  // of the spacing: mirror images may lie closer, for neither goes before the other
  const double spacing = kSpacing * std::cbrt(mesh.cell_size.prod());
  const auto different_limbs = bones_of_different_limbs(skeleton);
  const Eigen::VectorXi bones = dominant_bones(skin);
  const Eigen::Vector3d low = skin.vertices.rowwise().minCoeff();
  const Eigen::Vector3d middle = 0.5 * (low + skin.vertices.rowwise().maxCoeff());
  // Lowest first; among equals the outermost, so that a symmetric sole gets symmetric points. Mirror images have one rank.
  std::vector<std::tuple<long, long, long>> ranks;
  for (const auto x : skin.vertices.colwise()) {
    const double grain = 1e-3 * spacing;
    ranks.emplace_back(std::lround((x[1] - low[1]) / grain), -std::lround(std::abs(x[0] - middle[0]) / grain),
                       -std::lround(std::abs(x[2] - middle[2]) / grain));
  }
  const auto rank_of = [&ranks](int v) { return ranks[static_cast<std::size_t>(v)]; };
  std::vector<int> order(static_cast<std::size_t>(skin.vertices.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return rank_of(a) < rank_of(b); });

  std::vector<int> chosen;
  for (const int v : order) {
    const bool is_free = std::none_of(chosen.begin(), chosen.end(), [&](int other) {
      const double least = (symmetric && rank_of(v) == rank_of(other) ? kImageSpacing : 1) * spacing;
      return (skin.vertices.col(v) - skin.vertices.col(other)).squaredNorm() < least * least &&
             !different_limbs(bones[v], bones[other]);
    });
    if (is_free) chosen.push_back(v);
  }

  ContactPoints contact;
  contact.vertices = Eigen::Map<const Eigen::VectorXi>(chosen.data(), static_cast<Eigen::Index>(chosen.size()));
  contact.bones = bones(contact.vertices);
  contact.embedding = embed(mesh, skin.vertices(Eigen::all, contact.vertices), mesh.vertex_cells(contact.vertices));
  return contact;
}

Eigen::Matrix3Xd embedded_positions(const Embedding& embedding, const Eigen::Ref<const Eigen::Matrix3Xd>& nodes) {
  Eigen::Matrix3Xd positions = Eigen::Matrix3Xd::Zero(3, embedding.count());
  for (Eigen::Index p = 0; p < embedding.count(); ++p) {
    for (int k = 0; k < 4; ++k) positions.col(p) += embedding.weights(k, p) * nodes.col(embedding.nodes(k, p));
  }
  return positions;
}

}  // namespace hydrostat::retarget

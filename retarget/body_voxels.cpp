#include "retarget/body_voxels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hydrostat::retarget {
namespace {

double bone_weight(const SkinnedMesh& skin, int vertex, int bone) {
  for (const SkinnedMesh::Influence& influence : at(skin.skin_weights, vertex)) {
    if (influence.bone == bone) return influence.weight;
  }
  return 0;
}

int main_bone(const SkinnedMesh& skin, const SkinSample& sample) {
  int best = kNone;
  double most = -1;
  for (int k = 0; k < 3; ++k) {
    for (const SkinnedMesh::Influence& candidate : at(skin.skin_weights, skin.triangles(k, sample.triangle))) {
      double weight = 0;
      for (int j = 0; j < 3; ++j)
        weight += sample.shares[j] * bone_weight(skin, skin.triangles(j, sample.triangle), candidate.bone);
      if (weight > most || (weight == most && candidate.bone < best)) {
        most = weight;
        best = candidate.bone;
      }
    }
  }
  return best;
}

/// Strews points over the skin, at most half a voxel apart, and keeps for each voxel the one nearest to its middle.
void sample_skin(const SkinnedMesh& skin, BodyVoxels& body) {
  body.sample.assign(body.state.size(), {});
  std::vector<double> nearest(body.state.size(), std::numeric_limits<double>::infinity());
  const double spacing = 0.5 * body.lattice.voxel_size().minCoeff();
  for (int t = 0; t < skin.triangles.cols(); ++t) {
    const Eigen::Vector3d a = skin.vertices.col(skin.triangles(0, t));
    const Eigen::Vector3d b = skin.vertices.col(skin.triangles(1, t));
    const Eigen::Vector3d c = skin.vertices.col(skin.triangles(2, t));
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int steps = std::max(1, static_cast<int>(std::ceil(longest / spacing)));
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const Eigen::Vector3d shares = Eigen::Vector3d(steps - i - j, i, j) / steps;
        const Eigen::Vector3d point = shares[0] * a + shares[1] * b + shares[2] * c;
        const int voxel = body.voxel_at(point);
        const double distance = (point - body.middle(voxel)).squaredNorm();
        if (!body.is_body(voxel) || distance >= at(nearest, voxel)) continue;
        at(nearest, voxel) = distance;
        at(body.sample, voxel) = {t, shares};
      }
    }
  }
}

void spread_bones(const SkinnedMesh& skin, BodyVoxels& body) {
  body.bone.assign(body.state.size(), kNone);
  std::vector<int> front;
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (at(body.sample, v).triangle == kNone) continue;
    at(body.bone, v) = main_bone(skin, at(body.sample, v));
    front.push_back(v);
  }
  for (std::size_t next = 0; next < front.size(); ++next) {
    const int here = front[next];
    for_neighbours(body.voxels, here, [&](int neighbour) {
      if (!body.is_body(neighbour) || at(body.bone, neighbour) != kNone) return;
      at(body.bone, neighbour) = at(body.bone, here);
      front.push_back(neighbour);
    });
  }
}

}  // namespace

BodyVoxels body_voxels(const SkinnedMesh& skin, const TriangleSoup& closed, const Lattice& lattice) {
  BodyVoxels body{lattice, {lattice.cells}, {lattice.voxels()}, voxelize(closed, lattice), {}, {}};
  sample_skin(skin, body);
  spread_bones(skin, body);
  return body;
}

std::vector<SkinnedMesh::Influence> weights_at(const SkinnedMesh& skin, const SkinSample& sample) {
  std::vector<SkinnedMesh::Influence> weights;
  for (int k = 0; k < 3; ++k) {
    for (const SkinnedMesh::Influence& influence : at(skin.skin_weights, skin.triangles(k, sample.triangle))) {
      weights.push_back({influence.bone, influence.weight * sample.shares[k]});
    }
  }
  return weights;
}

double voxel_fill(const BodyVoxels& body, int voxel) {
  if (at(body.state, voxel) != Voxel::skin) return at(body.state, voxel) == Voxel::inside ? 1 : 0;
  int inside = 0, outside = 0;  // the lattice ends on the skin: what lies beyond tells nothing
  for_face_neighbours(body.voxels, voxel, [&](int next) {
    inside += at(body.state, next) == Voxel::inside;
    outside += at(body.state, next) == Voxel::outside;
  });
  return inside + outside == 0 ? 0.5 : static_cast<double>(inside) / (inside + outside);
}

double cells_outside(const BodyVoxels& body, const Eigen::Vector3d& point, int cell) {
  const Eigen::Vector3d place =
      (point - body.lattice.origin).cwiseQuotient(body.lattice.cell_size) - body.cells.place(cell).cast<double>();
  return std::max(0.0, ((place.array() - 0.5).abs() - 0.5).maxCoeff());
}

}  // namespace hydrostat::retarget

#include "retarget/voxelize.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "retarget/at.h"
#include "retarget/disjoint_sets.h"

namespace hydrostat::retarget {
namespace {

/// What openvdb::tools::meshToVolume asks of a mesh: corners in voxel units, with whole numbers at the voxels' centres.
struct VoxelSpaceMesh {
  Eigen::Matrix3Xd points;
  const Eigen::Matrix3Xi& triangles;

  std::size_t polygonCount() const { return static_cast<std::size_t>(triangles.cols()); }
  std::size_t pointCount() const { return static_cast<std::size_t>(points.cols()); }
  std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t triangle, std::size_t corner, openvdb::Vec3d& position) const {
    const int v = triangles(static_cast<Eigen::Index>(corner), static_cast<Eigen::Index>(triangle));
    position = openvdb::Vec3d(points(0, v), points(1, v), points(2, v));
  }
};

/// For each vertex the first vertex at the same place, to a millionth of the box.
std::vector<int> welded_vertices(const Eigen::Matrix3Xd& vertices) {
  const Eigen::Vector3d low = vertices.rowwise().minCoeff();
  const double extent = (vertices.rowwise().maxCoeff() - low).maxCoeff();
  const double grain = extent > 0 ? 1e-6 * extent : 1;
  std::map<std::array<long, 3>, int> first;
  std::vector<int> weld(static_cast<std::size_t>(vertices.cols()));
  for (int v = 0; v < vertices.cols(); ++v) {
    const Eigen::Vector3d place = (vertices.col(v) - low) / grain;
    const std::array<long, 3> key{std::lround(place[0]), std::lround(place[1]), std::lround(place[2])};
    weld[static_cast<std::size_t>(v)] = first.emplace(key, v).first->second;
  }
  return weld;
}

double triangle_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return 0.5 * (b - a).cross(c - a).norm();
}

/// Chains of edges that a single triangle uses, as welded vertices in order; a chain that does not close is closed by its
/// chord.
std::vector<std::vector<int>> rims(const std::vector<int>& weld, const Eigen::Matrix3Xi& triangles) {
  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = weld[static_cast<std::size_t>(triangles(k, t))];
      const int b = weld[static_cast<std::size_t>(triangles((k + 1) % 3, t))];
      if (a != b) ++uses[std::minmax(a, b)];
    }
  }
  std::map<int, std::vector<int>> open;
  for (const auto& [edge, count] : uses) {
    if (count != 1) continue;
    open[edge.first].push_back(edge.second);
    open[edge.second].push_back(edge.first);
  }
  auto take = [&](int from) {
    std::vector<int>& ways = open[from];
    const int to = ways.front();
    ways.erase(ways.begin());
    std::vector<int>& back = open[to];
    back.erase(std::find(back.begin(), back.end(), from));
    return to;
  };
  std::vector<std::vector<int>> found;
  for (const auto& entry : open) {
    const int start = entry.first;
    while (!open[start].empty()) {
      std::vector<int> rim{start};
      int here = take(start);
      while (here != start) {
        rim.push_back(here);
        if (open[here].empty()) break;
        here = take(here);
      }
      if (rim.size() > 2) found.push_back(std::move(rim));
    }
  }
  return found;
}

struct Flood {
  Eigen::Vector3i size;  // with one layer of air on every side
  std::vector<Voxel> state;

  std::size_t index(int x, int y, int z) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(size[0]) *
               (static_cast<std::size_t>(y) + static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(z));
  }
};

/// Everything that no skin keeps from the outer layer becomes outside.
void flood_from_outside(Flood& grid) {
  std::vector<Eigen::Vector3i> front{Eigen::Vector3i::Zero()};
  grid.state[0] = Voxel::outside;
  while (!front.empty()) {
    const Eigen::Vector3i here = front.back();
    front.pop_back();
    for (int axis = 0; axis < 3; ++axis) {
      for (int step : {-1, 1}) {
        Eigen::Vector3i next = here;
        next[axis] += step;
        if (next[axis] < 0 || next[axis] >= grid.size[axis]) continue;
        Voxel& state = grid.state[grid.index(next[0], next[1], next[2])];
        if (state != Voxel::inside) continue;
        state = Voxel::outside;
        front.push_back(next);
      }
    }
  }
}

}  // namespace

TriangleSoup with_closed_holes(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles) {
  std::vector<int> weld = welded_vertices(vertices);
  DisjointSets shells(static_cast<int>(weld.size()));
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    for (int k = 1; k < 3; ++k) shells.join(at(weld, triangles(0, t)), at(weld, triangles(k, t)));
  }
  std::vector<double> shell_area(weld.size(), 0);
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    at(shell_area, shells.root(at(weld, triangles(0, t)))) +=
        triangle_area(vertices.col(triangles(0, t)), vertices.col(triangles(1, t)), vertices.col(triangles(2, t)));
  }

  std::vector<Eigen::Vector3d> middles;
  std::vector<Eigen::Vector3i> lids;
  for (const std::vector<int>& rim : rims(weld, triangles)) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double length = 0;
    for (std::size_t i = 0; i < rim.size(); ++i) {
      middle += vertices.col(rim[i]) / static_cast<double>(rim.size());
      length += (vertices.col(rim[(i + 1) % rim.size()]) - vertices.col(rim[i])).norm();
    }
    const double widest_lid = length * length / (4 * std::numbers::pi);
    if (widest_lid > 0.55 * at(shell_area, shells.root(rim[0]))) continue;
    const int hub = static_cast<int>(vertices.cols() + static_cast<Eigen::Index>(middles.size()));
    middles.push_back(middle);
    for (std::size_t i = 0; i < rim.size(); ++i) lids.emplace_back(rim[i], rim[(i + 1) % rim.size()], hub);
  }

  TriangleSoup closed;
  closed.vertices.resize(3, vertices.cols() + static_cast<Eigen::Index>(middles.size()));
  closed.vertices.leftCols(vertices.cols()) = vertices;
  for (std::size_t i = 0; i < middles.size(); ++i)
    closed.vertices.col(vertices.cols() + static_cast<Eigen::Index>(i)) = middles[i];
  closed.triangles.resize(3, triangles.cols() + static_cast<Eigen::Index>(lids.size()));
  closed.triangles.leftCols(triangles.cols()) = triangles;
  for (std::size_t i = 0; i < lids.size(); ++i)
    closed.triangles.col(triangles.cols() + static_cast<Eigen::Index>(i)) = lids[i];
  return closed;
}

std::vector<Voxel> voxelize(const TriangleSoup& soup, const Lattice& lattice) {
  static const bool ready = (openvdb::initialize(), true);
  (void)ready;
  VoxelSpaceMesh mesh{soup.vertices, soup.triangles};
  mesh.points.colwise() -= lattice.origin;
  mesh.points = lattice.voxel_size().cwiseInverse().asDiagonal() * mesh.points;
  mesh.points.array() -= 0.5;
  const openvdb::FloatGrid::Ptr distance = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      mesh, openvdb::math::Transform(), 1.5f, 1.5f, openvdb::tools::UNSIGNED_DISTANCE_FIELD);

  const Eigen::Vector3i count = lattice.voxels();
  Flood grid{count.array() + 2, {}};
  grid.state.assign(static_cast<std::size_t>(grid.size.cast<long>().prod()), Voxel::inside);
  // A little more than half, so that a face right between two layers of voxels, rounded either way, marks both.
  constexpr float kReach = 0.501f;
  for (auto voxel = distance->cbeginValueOn(); voxel; ++voxel) {
    if (*voxel > kReach) continue;
    const openvdb::Coord at = voxel.getCoord();
    const Eigen::Vector3i place(at.x() + 1, at.y() + 1, at.z() + 1);
    if ((place.array() < 1).any() || (place.array() > count.array()).any()) continue;
    grid.state[grid.index(place[0], place[1], place[2])] = Voxel::skin;
  }
  flood_from_outside(grid);

  std::vector<Voxel> voxels;
  voxels.reserve(static_cast<std::size_t>(count.cast<long>().prod()));
  for (int z = 1; z <= count[2]; ++z) {
    for (int y = 1; y <= count[1]; ++y) {
      for (int x = 1; x <= count[0]; ++x) voxels.push_back(grid.state[grid.index(x, y, z)]);
    }
  }
  return voxels;
}

}  // namespace hydrostat::retarget

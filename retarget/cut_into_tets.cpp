#include "retarget/cut_into_tets.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "retarget/disjoint_sets.h"

namespace hydrostat::retarget {
namespace {

constexpr double kLeastFill = 0.05;  // of a kept cell: a sheet still has mass

/// The five tets of a cell by corner; neighbouring cells take turns, so that the diagonals of common faces agree.
constexpr int kFiveTets[2][5][4] = {
    {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 3, 6}, {4, 0, 5, 6}, {7, 3, 5, 6}},
    {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 1, 2, 7}, {5, 1, 4, 7}, {6, 2, 4, 7}},
};

}  // namespace

void cut_into_tets(const Lattice& lattice, const BodyCells& cells, ControlMesh& mesh) {
  const Grid grid{lattice.cells};
  mesh.cells = cells.count();
  mesh.origin = lattice.origin;
  mesh.cell_size = lattice.cell_size;
  mesh.nodes.resize(3, static_cast<Eigen::Index>(cells.node_places.size()));
  for (int n = 0; n < mesh.node_count(); ++n)
    mesh.nodes.col(n) = mesh.origin + mesh.cell_size.cwiseProduct(at(cells.node_places, n).cast<double>());
  mesh.tets.resize(4, 5 * mesh.cells);
  mesh.tet_fill.resize(5 * mesh.cells);
  mesh.cell_nodes.resize(8, mesh.cells);
  mesh.cell_places.resize(3, mesh.cells);
  std::set<std::pair<int, int>> edges;
  std::set<int> places;
  for (int c = 0; c < mesh.cells; ++c) {
    for (int k = 0; k < 8; ++k) mesh.cell_nodes(k, c) = at(at(cells.nodes, c), k);
    mesh.cell_places.col(c) = grid.place(at(cells.place, c));
    mesh.copied_cells += !places.insert(at(cells.place, c)).second;
    for (int t = 0; t < 5; ++t) {
      Eigen::Vector4i tet;
      for (int k = 0; k < 4; ++k) tet[k] = at(at(cells.nodes, c), kFiveTets[mesh.cell_places.col(c).sum() % 2][t][k]);
      Eigen::Matrix3d spans;
      for (int k = 0; k < 3; ++k) spans.col(k) = mesh.nodes.col(tet[k + 1]) - mesh.nodes.col(tet[0]);
      if (spans.determinant() < 0) std::swap(tet[2], tet[3]);
      mesh.tets.col(5 * c + t) = tet;
      mesh.tet_fill[5 * c + t] = std::clamp(at(cells.fill, c), kLeastFill, 1.0);
      for (int i = 0; i < 4; ++i) {
        for (int j = i + 1; j < 4; ++j) edges.insert(std::minmax(tet[i], tet[j]));
      }
    }
  }
  mesh.pieces = count_pieces(mesh.tets);
  mesh.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  Eigen::Index e = 0;
  for (const auto& [a, b] : edges) mesh.edges.col(e++) << a, b;
}

int count_pieces(const Eigen::Matrix4Xi& tets) {
  DisjointSets sets(static_cast<int>(tets.cols()));
  int pieces = static_cast<int>(tets.cols());
  std::map<std::array<int, 3>, int> first;
  for (int t = 0; t < tets.cols(); ++t) {
    for (int left_out = 0; left_out < 4; ++left_out) {
      std::array<int, 3> face;
      for (int k = 0; k < 3; ++k) at(face, k) = tets((left_out + 1 + k) % 4, t);
      std::sort(face.begin(), face.end());
      pieces -= sets.join(first.emplace(face, t).first->second, t);
    }
  }
  return pieces;
}

}  // namespace hydrostat::retarget

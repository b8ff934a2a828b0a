#include "retarget/number_cells.h"

#include <algorithm>
#include <map>

#include "retarget/disjoint_sets.h"

namespace hydrostat::retarget {

BodyCells number_cells(const Grid& grid, const BodyParts& body) {
  DisjointSets corners(8 * body.count());
  for (const Link& link : body.links) {
    if (!at(body.parts, link.low).kept || !at(body.parts, link.high).kept) continue;
    for (int k = 0; k < 8; ++k) {
      if (corner_step(k)[link.axis] == 0) corners.join(8 * link.high + k, 8 * link.low + (k | 1 << link.axis));
    }
  }
  for (const auto& [a, b] : body.merges) {
    for (int k = 0; k < 8; ++k) corners.join(8 * a + k, 8 * b + k);
  }
  std::vector<int> order;
  for (int p = 0; p < body.count(); ++p) {
    if (at(body.parts, p).kept) order.push_back(p);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return at(body.parts, a).cell < at(body.parts, b).cell; });

  BodyCells cells;
  cells.cell_of_part.assign(body.parts.size(), kNone);
  std::map<std::array<int, 8>, int> cell_with;
  std::map<int, int> node_of_root;
  for (const int p : order) {
    std::array<int, 8> roots;
    for (int k = 0; k < 8; ++k) at(roots, k) = corners.root(8 * p + k);
    const auto [entry, is_new] = cell_with.emplace(roots, cells.count());
    at(cells.cell_of_part, p) = entry->second;
    if (!is_new) {
      at(cells.fill, entry->second) += at(body.parts, p).fill;
      continue;
    }
    cells.place.push_back(at(body.parts, p).cell);
    cells.fill.push_back(at(body.parts, p).fill);
    std::array<int, 8> nodes;
    for (int k = 0; k < 8; ++k) {
      const auto [node, is_new_node] = node_of_root.emplace(at(roots, k), static_cast<int>(cells.node_places.size()));
      if (is_new_node) cells.node_places.push_back(grid.place(at(body.parts, p).cell) + corner_step(k));
      at(nodes, k) = node->second;
    }
    cells.nodes.push_back(nodes);
  }
  return cells;
}

Eigen::VectorXi cells_of_vertices(const BodyVoxels& body, const BodyParts& parts, const BodyCells& cells,
                                  const std::vector<int>& vertex_parts, const SkinnedMesh& skin) {
  Eigen::VectorXi vertex_cells(skin.vertices.cols());
  std::vector<int> kept;
  for (int p = 0; p < parts.count(); ++p) {
    if (at(parts.parts, p).kept) kept.push_back(p);
  }
  for (int v = 0; v < vertex_cells.size(); ++v) {
    int part = at(vertex_parts, v);
    if (part == kNone || !at(parts.parts, part).kept) {
      std::vector<int> hosts;
      for (const Link& link : parts.links) {
        if (link.low == part && at(parts.parts, link.high).kept) hosts.push_back(link.high);
        if (link.high == part && at(parts.parts, link.low).kept) hosts.push_back(link.low);
      }
      const std::vector<int>& choice = hosts.empty() ? kept : hosts;
      part = *std::min_element(choice.begin(), choice.end(), [&](int a, int b) {
        return cells_outside(body, skin.vertices.col(v), at(parts.parts, a).cell) <
               cells_outside(body, skin.vertices.col(v), at(parts.parts, b).cell);
      });
    }
    vertex_cells[v] = at(cells.cell_of_part, part);
  }
  return vertex_cells;
}

}  // namespace hydrostat::retarget

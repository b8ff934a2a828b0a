#include "retarget/control_mesh.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <set>
#include <tuple>
#include <vector>

#include "retarget/error.h"
#include "retarget/limbs.h"
#include "retarget/voxelize.h"

namespace hydrostat::retarget {
namespace {

constexpr int kNone = -1;
constexpr double kCrumb = 0.06;      // share of a cell below which a part is no part of its own
constexpr double kLeastFill = 0.05;  // of a kept cell: a sheet still has mass

template <typename Vector>
auto& at(Vector& values, int i) {
  return values[static_cast<std::size_t>(i)];
}

struct Sets {
  explicit Sets(int count) : parent(static_cast<std::size_t>(count)) { std::iota(parent.begin(), parent.end(), 0); }
  int root(int i) {
    while (at(parent, i) != i) i = at(parent, i) = at(parent, at(parent, i));
    return i;
  }
  /// The lesser root stays the root, so the outcome does not hang on the order of calls.
  bool join(int a, int b) {
    a = root(a);
    b = root(b);
    at(parent, std::max(a, b)) = std::min(a, b);
    return a != b;
  }
  std::vector<int> parent;
};

/// Counts places of a box, x fastest.
struct Box {
  Eigen::Vector3i size;

  int count() const { return size.prod(); }
  bool holds(const Eigen::Vector3i& place) const {
    return (place.array() >= 0).all() && (place.array() < size.array()).all();
  }
  int index(const Eigen::Vector3i& place) const { return place[0] + size[0] * (place[1] + size[1] * place[2]); }
  Eigen::Vector3i place(int index) const { return {index % size[0], index / size[0] % size[1], index / size[0] / size[1]}; }
};

/// A point of the skin, as a mean of a triangle's corners.
struct SkinSample {
  int triangle = kNone;
  Eigen::Vector3d shares = Eigen::Vector3d::Zero();
};

/// The part of the body that one cell holds in one piece.
struct Part {
  int cell;     // index in the box of cells
  double fill;  // share of the cell
  bool kept = true;
};

/// Two parts in neighbouring cells, the second one step further along the axis, that touch across the face between.
struct Link {
  int low, high, axis;

  auto operator<=>(const Link&) const = default;
};

/// The body in voxels, and what each coarse cell holds of it.
struct Partition {
  Lattice lattice;
  Box cells, voxels;
  std::vector<Voxel> state;        // per voxel
  std::vector<int> bone;           // per voxel; kNone where there is no body
  std::vector<SkinSample> sample;  // per voxel; the skin point nearest to its middle
  std::vector<int> part_of;        // per voxel; kNone where there is no body
  std::vector<Part> parts;
  std::set<Link> links;
  std::vector<std::pair<int, int>> merges;  // parts of one cell that become one

  int cell_of(int voxel) const { return cells.index(voxels.place(voxel) / lattice.fine); }
  int voxel_at(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d place = (point - lattice.origin).cwiseQuotient(lattice.voxel_size());
    const Eigen::Vector3d top = (voxels.size.array() - 1).cast<double>();
    return voxels.index(place.array().floor().matrix().cwiseMax(0).cwiseMin(top).cast<int>());
  }
  Eigen::Vector3d middle(int voxel) const {
    return lattice.origin + lattice.voxel_size().cwiseProduct((voxels.place(voxel).cast<double>().array() + 0.5).matrix());
  }
};

/// Calls visit(neighbour) for the voxels of the box that are within `reach` voxels along each axis: 1 are those that touch
/// this one.
template <typename Visit>
void for_neighbours(const Box& box, int voxel, const Visit& visit, int reach = 1) {
  const Eigen::Vector3i here = box.place(voxel);
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Eigen::Vector3i next = here + Eigen::Vector3i(x, y, z);
        if ((x || y || z) && box.holds(next)) visit(box.index(next));
      }
    }
  }
}

Lattice fitted_lattice(const SkinnedMesh& skin, const Eigen::Vector3i& cells, int fine) {
  const Eigen::Vector3d low = skin.vertices.rowwise().minCoeff();
  const Eigen::Vector3d size = skin.vertices.rowwise().maxCoeff() - low;
  // A sheet has no extent along one axis: its one cell there is 0.75 of the others' size, the sheet in its middle, or on its
  // bottom along y.
  const double usual = size.cwiseQuotient(cells.cast<double>()).maxCoeff();
  Lattice lattice{low, size.cwiseQuotient(cells.cast<double>()), cells, fine};
  lattice.cell_size = (cells.array() == 1).select(lattice.cell_size.cwiseMax(0.75 * usual), lattice.cell_size);
  for (int axis : {0, 2}) lattice.origin[axis] -= 0.5 * (lattice.cell_size[axis] * cells[axis] - size[axis]);
  return lattice;
}

double bone_weight(const SkinnedMesh& skin, int vertex, int bone) {
  for (const SkinnedMesh::Influence& influence : at(skin.skin_weights, vertex)) {
    if (influence.bone == bone) return influence.weight;
  }
  return 0;
}

/// Skin weights at a sample, as pairs of bone and weight that sum to 1.
std::vector<SkinnedMesh::Influence> weights_at(const SkinnedMesh& skin, const SkinSample& sample) {
  std::vector<SkinnedMesh::Influence> weights;
  for (int k = 0; k < 3; ++k) {
    for (const SkinnedMesh::Influence& influence : at(skin.skin_weights, skin.triangles(k, sample.triangle))) {
      weights.push_back({influence.bone, influence.weight * sample.shares[k]});
    }
  }
  return weights;
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
void sample_skin(const SkinnedMesh& skin, Partition& body) {
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
        if (at(body.state, voxel) == Voxel::outside || distance >= at(nearest, voxel)) continue;
        at(nearest, voxel) = distance;
        at(body.sample, voxel) = {t, shares};
      }
    }
  }
}

/// Each voxel of the body belongs to the main bone of the skin nearest to it through the body.
void spread_bones(const SkinnedMesh& skin, Partition& body) {
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
      if (at(body.state, neighbour) == Voxel::outside || at(body.bone, neighbour) != kNone) return;
      at(body.bone, neighbour) = at(body.bone, here);
      front.push_back(neighbour);
    });
  }
}

using LimbTable = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic>;

bool may_touch(const Partition& body, const LimbTable& different_limbs, int a, int b) {
  const int bone_a = at(body.bone, a);
  const int bone_b = at(body.bone, b);
  return bone_a == kNone || bone_b == kNone || !different_limbs(bone_a, bone_b);
}

/// Share of a voxel that the body fills: of the skin's, as many as its neighbours by faces that lie inside rather than
/// outside.
double voxel_fill(const Partition& body, int voxel) {
  if (at(body.state, voxel) != Voxel::skin) return at(body.state, voxel) == Voxel::inside ? 1 : 0;
  int inside = 0, outside = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      Eigen::Vector3i next = body.voxels.place(voxel);
      next[axis] += step;
      if (!body.voxels.holds(next)) continue;  // the lattice ends on the skin: what lies beyond tells nothing
      inside += at(body.state, body.voxels.index(next)) == Voxel::inside;
      outside += at(body.state, body.voxels.index(next)) == Voxel::outside;
    }
  }
  return inside + outside == 0 ? 0.5 : static_cast<double>(inside) / (inside + outside);
}

/// Parts are the connected voxels within a cell. Crumbs that the border between two limbs leaves are given to what they
/// touch.
void find_parts(const LimbTable& different_limbs, Partition& body) {
  const double voxel_share = 1.0 / std::pow(body.lattice.fine, 3);
  Sets sets(body.voxels.count());
  auto is_body = [&](int v) { return at(body.state, v) != Voxel::outside; };
  auto for_cellmates = [&](int v, const auto& visit) {
    for_neighbours(body.voxels, v, [&](int w) {
      if (w > v && is_body(w) && body.cell_of(w) == body.cell_of(v)) visit(w);
    });
  };
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (!is_body(v)) continue;
    for_cellmates(v, [&](int w) {
      if (may_touch(body, different_limbs, v, w)) sets.join(v, w);
    });
  }
  std::vector<double> fill(body.state.size(), 0);
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (is_body(v)) at(fill, sets.root(v)) += voxel_share * voxel_fill(body, v);
  }
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (!is_body(v)) continue;
    for_cellmates(v, [&](int w) {
      const int a = sets.root(v);
      const int b = sets.root(w);
      if (a == b || std::min(at(fill, a), at(fill, b)) >= kCrumb) return;
      const double sum = at(fill, a) + at(fill, b);
      sets.join(a, b);
      at(fill, sets.root(a)) = sum;
    });
  }
  body.part_of.assign(body.state.size(), kNone);
  std::map<int, int> part_of_root;
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (!is_body(v)) continue;
    const int root = sets.root(v);
    const auto [entry, is_new] = part_of_root.emplace(root, static_cast<int>(body.parts.size()));
    if (is_new) body.parts.push_back({body.cell_of(v), std::min(1.0, at(fill, root))});
    at(body.part_of, v) = entry->second;
  }
}

/// Parts in neighbouring cells are linked where their voxels touch across the common face, straight or askew. A touch that
/// is small for both parts is left out: where two limbs' skins coincide, a few voxels of each are taken for the other's.
void find_links(const LimbTable& different_limbs, Partition& body) {
  constexpr double kSmall = 0.2;  // touching voxels over the most that the part has across that face
  const int fine = body.lattice.fine;
  std::map<Link, int> touches;
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (at(body.part_of, v) == kNone) continue;
    const Eigen::Vector3i here = body.voxels.place(v);
    for (int axis = 0; axis < 3; ++axis) {
      if (here[axis] % fine != fine - 1) continue;
      for (int first = -1; first <= 1; ++first) {
        for (int second = -1; second <= 1; ++second) {
          Eigen::Vector3i next = here;
          next[axis] += 1;
          next[(axis + 1) % 3] += first;
          next[(axis + 2) % 3] += second;
          if (!body.voxels.holds(next)) continue;
          const bool share_a_face = next[(axis + 1) % 3] / fine == here[(axis + 1) % 3] / fine &&
                                    next[(axis + 2) % 3] / fine == here[(axis + 2) % 3] / fine;
          const int w = body.voxels.index(next);
          if (!share_a_face || at(body.part_of, w) == kNone || !may_touch(body, different_limbs, v, w)) continue;
          ++touches[{at(body.part_of, v), at(body.part_of, w), axis}];
        }
      }
    }
  }
  std::map<std::pair<int, int>, int> most_above, most_below;  // per part and axis
  for (const auto& [link, count] : touches) {
    int& above = most_above[{link.low, link.axis}];
    int& below = most_below[{link.high, link.axis}];
    above = std::max(above, count);
    below = std::max(below, count);
  }
  for (const auto& [link, count] : touches) {
    if (count >= kSmall * std::min(most_above[{link.low, link.axis}], most_below[{link.high, link.axis}]))
      body.links.insert(link);
  }
}

/// The part of the voxel that holds a skin point, or of the nearest around it where that is air or another limb's; kNone
/// where there is none.
int part_at(const Partition& body, const LimbTable& different_limbs, const Eigen::Vector3d& point, int bone) {
  const int voxel = body.voxel_at(point);
  int best = kNone;
  std::pair<bool, double> least{true, std::numeric_limits<double>::infinity()};
  auto offer = [&](int candidate) {
    if (at(body.part_of, candidate) == kNone) return;
    const bool is_other_limb = at(body.bone, candidate) != kNone && different_limbs(at(body.bone, candidate), bone);
    const std::pair<bool, double> price{is_other_limb,
                                        candidate == voxel ? 0 : (body.middle(candidate) - point).squaredNorm()};
    if (price >= least) return;
    least = price;
    best = at(body.part_of, candidate);
  };
  offer(voxel);
  for_neighbours(body.voxels, voxel, offer,
                 /*reach=*/2);  // where two limbs' skins touch, one of them owns the voxels on both sides
  return best;
}

/// How far [cells, the largest of the three] a point lies outside a cell; 0 within.
double cells_outside(const Partition& body, const Eigen::Vector3d& point, int cell) {
  const Eigen::Vector3d place =
      (point - body.lattice.origin).cwiseQuotient(body.lattice.cell_size) - body.cells.place(cell).cast<double>();
  return std::max(0.0, ((place.array() - 0.5).abs() - 0.5).maxCoeff());
}

/// Drops the parts that are a thin layer on a fuller neighbour: skin that lies on the border of two cells, give or take a
/// voxel.
void drop_slivers(const std::vector<int>& vertex_parts, const SkinnedMesh& skin, double least_fill, Partition& body) {
  std::vector<std::vector<int>> hosts(body.parts.size());
  for (const Link& link : body.links) {
    if (at(body.parts, link.high).fill >= least_fill) at(hosts, link.low).push_back(link.high);
    if (at(body.parts, link.low).fill >= least_fill) at(hosts, link.high).push_back(link.low);
  }
  auto lies_on_a_host = [&](int part, const Eigen::Vector3d& point, double reach) {
    return std::any_of(at(hosts, part).begin(), at(hosts, part).end(),
                       [&](int host) { return cells_outside(body, point, at(body.parts, host).cell) <= reach; });
  };
  std::vector<bool> is_sliver(body.parts.size());
  for (std::size_t p = 0; p < is_sliver.size(); ++p) is_sliver[p] = body.parts[p].fill < least_fill && !hosts[p].empty();
  for (int v = 0; v < body.voxels.count(); ++v) {
    const int part = at(body.part_of, v);
    if (part != kNone && is_sliver[static_cast<std::size_t>(part)] &&
        !lies_on_a_host(part, body.middle(v), least_fill + 0.5 / body.lattice.fine))
      is_sliver[static_cast<std::size_t>(part)] = false;
  }
  for (int v = 0; v < skin.vertices.cols(); ++v) {
    const int part = at(vertex_parts, v);
    if (part != kNone && is_sliver[static_cast<std::size_t>(part)] &&
        !lies_on_a_host(part, skin.vertices.col(v), least_fill))
      is_sliver[static_cast<std::size_t>(part)] = false;
  }
  for (std::size_t p = 0; p < is_sliver.size(); ++p) body.parts[p].kept = !is_sliver[p];
}

/// Face-connected pieces of the kept parts: for each part a part that names its piece.
std::vector<int> find_pieces(const Partition& body) {
  Sets sets(static_cast<int>(body.parts.size()));
  for (const Link& link : body.links) {
    if (at(body.parts, link.low).kept && at(body.parts, link.high).kept) sets.join(link.low, link.high);
  }
  for (const auto& [a, b] : body.merges) sets.join(a, b);
  std::vector<int> piece(body.parts.size());
  for (std::size_t p = 0; p < piece.size(); ++p) piece[p] = sets.root(static_cast<int>(p));
  return piece;
}

/// The cheapest way from one piece to any other: through parts that are there at next to nothing, through empty cells at 1
/// to 2 each, the fuller the cheaper. Stops are parts, or the number of parts plus the index of an empty cell.
std::vector<int> cheapest_way(const Partition& body, const std::vector<int>& piece, int from) {
  const int part_count = static_cast<int>(body.parts.size());
  std::vector<std::vector<int>> parts_in(static_cast<std::size_t>(body.cells.count()));
  std::vector<double> dropped_fill(parts_in.size(), 0);
  for (int p = 0; p < part_count; ++p) {
    const Part& part = at(body.parts, p);
    if (part.kept)
      at(parts_in, part.cell).push_back(p);
    else
      at(dropped_fill, part.cell) += part.fill;
  }
  std::vector<double> cost(static_cast<std::size_t>(part_count + body.cells.count()),
                           std::numeric_limits<double>::infinity());
  std::vector<int> before(cost.size(), kNone);
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> front;
  auto offer = [&](int stop, double price, int previous) {
    if (price >= at(cost, stop)) return;
    at(cost, stop) = price;
    at(before, stop) = previous;
    front.emplace(price, stop);
  };
  for (int p = 0; p < part_count; ++p) {
    if (at(body.parts, p).kept && at(piece, p) == from) offer(p, 0, kNone);
  }
  while (!front.empty()) {
    const auto [price, stop] = front.top();
    front.pop();
    if (price > at(cost, stop)) continue;
    if (stop < part_count && at(piece, stop) != from) {
      std::vector<int> way;
      for (int s = stop; s != kNone; s = at(before, s)) way.push_back(s);
      std::reverse(way.begin(), way.end());
      return way;
    }
    const int cell = stop < part_count ? at(body.parts, stop).cell : stop - part_count;
    for (const int mate : at(parts_in, cell)) offer(mate, price + 0.1, stop);
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Eigen::Vector3i place = body.cells.place(cell);
        place[axis] += step;
        if (!body.cells.holds(place)) continue;
        const int next = body.cells.index(place);
        for (const int part : at(parts_in, next)) offer(part, price + 0.1, stop);
        if (at(parts_in, next).empty()) offer(part_count + next, price + 2 - std::min(1.0, at(dropped_fill, next)), stop);
      }
    }
  }
  return {};
}

/// Joins all pieces into one, the lightest first, by the cheapest cells between. A piece that is farther away than it is
/// large is dropped. Returns the number of cells added.
int join_pieces(Partition& body) {
  int added = 0;
  for (;;) {
    const std::vector<int> piece = find_pieces(body);
    std::map<int, std::pair<double, int>> pieces;  // fill and cells
    for (std::size_t p = 0; p < piece.size(); ++p) {
      if (!body.parts[p].kept) continue;
      pieces[piece[p]].first += body.parts[p].fill;
      ++pieces[piece[p]].second;
    }
    if (pieces.size() < 2) return added;
    const auto lightest =
        std::min_element(pieces.begin(), pieces.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    std::vector<int> way = cheapest_way(body, piece, lightest->first);
    const int part_count = static_cast<int>(body.parts.size());
    const auto bridges = std::count_if(way.begin(), way.end(), [&](int stop) { return stop >= part_count; });
    if (bridges > std::max(2, lightest->second.second)) {
      for (std::size_t p = 0; p < piece.size(); ++p) body.parts[p].kept = body.parts[p].kept && piece[p] != lightest->first;
      continue;
    }
    for (int& stop : way) {
      if (stop < part_count) continue;
      double fill = 0;
      for (const Part& part : body.parts) fill += part.cell == stop - part_count ? part.fill : 0;
      body.parts.push_back({stop - part_count, fill});
      stop = static_cast<int>(body.parts.size()) - 1;
      ++added;
    }
    for (std::size_t i = 1; i < way.size(); ++i) {
      const auto [low, high] =
          std::minmax(way[i - 1], way[i], [&](int a, int b) { return at(body.parts, a).cell < at(body.parts, b).cell; });
      const Eigen::Vector3i step = body.cells.place(at(body.parts, high).cell) - body.cells.place(at(body.parts, low).cell);
      if (step.isZero()) {
        body.merges.emplace_back(low, high);
      } else {
        body.links.insert({low, high, step[0] ? 0 : step[1] ? 1 : 2});
      }
    }
  }
}

/// Corner k of a cell is its lowest corner moved by the bits of k along x, y and z.
Eigen::Vector3i corner_step(int corner) { return {corner & 1, corner >> 1 & 1, corner >> 2 & 1}; }

/// The cells of the body and the nodes they share: parts that share all eight corners are one cell.
struct Cells {
  std::vector<int> cell_of_part;             // per part; kNone where dropped
  std::vector<int> place;                    // per cell, index in the box of cells
  std::vector<double> fill;                  // per cell
  std::vector<std::array<int, 8>> nodes;     // per cell
  std::vector<Eigen::Vector3i> node_places;  // per node, in the lattice's planes
};

Cells number_cells(const Partition& body) {
  const int part_count = static_cast<int>(body.parts.size());
  Sets corners(8 * part_count);
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
  for (int p = 0; p < part_count; ++p) {
    if (at(body.parts, p).kept) order.push_back(p);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return at(body.parts, a).cell < at(body.parts, b).cell; });

  Cells cells;
  cells.cell_of_part.assign(static_cast<std::size_t>(part_count), kNone);
  std::map<std::array<int, 8>, int> cell_with;
  std::map<int, int> node_of_root;
  for (const int p : order) {
    std::array<int, 8> roots;
    for (int k = 0; k < 8; ++k) at(roots, k) = corners.root(8 * p + k);
    const auto [entry, is_new] = cell_with.emplace(roots, static_cast<int>(cells.place.size()));
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
      if (is_new_node) cells.node_places.push_back(body.cells.place(at(body.parts, p).cell) + corner_step(k));
      at(nodes, k) = node->second;
    }
    cells.nodes.push_back(nodes);
  }
  return cells;
}

/// The five tets of a cell by corner; neighbouring cells take turns, so that the diagonals of common faces agree.
constexpr int kFiveTets[2][5][4] = {
    {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 3, 6}, {4, 0, 5, 6}, {7, 3, 5, 6}},
    {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 1, 2, 7}, {5, 1, 4, 7}, {6, 2, 4, 7}},
};

void cut_into_tets(const Partition& body, const Cells& cells, ControlMesh& mesh) {
  mesh.cells = static_cast<int>(cells.place.size());
  mesh.origin = body.lattice.origin;
  mesh.cell_size = body.lattice.cell_size;
  mesh.nodes.resize(3, static_cast<Eigen::Index>(cells.node_places.size()));
  for (int n = 0; n < mesh.node_count(); ++n)
    mesh.nodes.col(n) = mesh.origin + mesh.cell_size.cwiseProduct(at(cells.node_places, n).cast<double>());
  mesh.tets.resize(4, 5 * mesh.cells);
  mesh.tet_fill.resize(5 * mesh.cells);
  mesh.cell_places.resize(3, mesh.cells);
  std::set<std::pair<int, int>> edges;
  std::set<int> places;
  for (int c = 0; c < mesh.cells; ++c) {
    mesh.cell_places.col(c) = body.cells.place(at(cells.place, c));
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
  mesh.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  Eigen::Index e = 0;
  for (const auto& [a, b] : edges) mesh.edges.col(e++) << a, b;
}

/// The cell of each skin vertex: of its own part, or where that was dropped of the nearest part, its own limb's first.
void assign_vertices(const std::vector<int>& vertex_parts, const SkinnedMesh& skin, const Partition& body,
                     const Cells& cells, ControlMesh& mesh) {
  mesh.vertex_cells.resize(skin.vertices.cols());
  std::vector<int> kept;
  for (int p = 0; p < static_cast<int>(body.parts.size()); ++p) {
    if (at(body.parts, p).kept) kept.push_back(p);
  }
  for (int v = 0; v < mesh.vertex_cells.size(); ++v) {
    int part = at(vertex_parts, v);
    if (part == kNone || !at(body.parts, part).kept) {
      std::vector<int> hosts;
      for (const Link& link : body.links) {
        if (link.low == part && at(body.parts, link.high).kept) hosts.push_back(link.high);
        if (link.high == part && at(body.parts, link.low).kept) hosts.push_back(link.low);
      }
      const std::vector<int>& choice = hosts.empty() ? kept : hosts;
      part = *std::min_element(choice.begin(), choice.end(), [&](int a, int b) {
        return cells_outside(body, skin.vertices.col(v), at(body.parts, a).cell) <
               cells_outside(body, skin.vertices.col(v), at(body.parts, b).cell);
      });
    }
    mesh.vertex_cells[v] = at(cells.cell_of_part, part);
  }
}

/// Skin weights spread into the volume: nodes take the mean of the skin samples in their tets, the square of the barycentric
/// weight as strength, and a little of their neighbours; a node without samples takes its neighbours' mean. One sparse solve
/// with an M-matrix, so that no weight is negative, and every node's weights sum to 1.
Eigen::MatrixXd spread_bone_weights(const Skeleton& skeleton, const SkinnedMesh& skin, const Partition& body,
                                    const Cells& cells, const ControlMesh& mesh) {
  constexpr double kNeighbours = 0.02;  // strength of an edge over the mean strength of the samples at a node
  std::vector<Eigen::Vector3d> points;
  std::vector<int> point_cells, point_voxels;
  for (int v = 0; v < body.voxels.count(); ++v) {
    const SkinSample& sample = at(body.sample, v);
    if (sample.triangle == kNone || at(body.part_of, v) == kNone || at(cells.cell_of_part, at(body.part_of, v)) == kNone)
      continue;
    points.push_back(skin.vertices(Eigen::all, skin.triangles.col(sample.triangle)) * sample.shares);
    point_cells.push_back(at(cells.cell_of_part, at(body.part_of, v)));
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

Partition partition_body(const LimbTable& different_limbs, const SkinnedMesh& skin, const TriangleSoup& closed,
                         const Lattice& lattice) {
  Partition body;
  body.lattice = lattice;
  body.cells.size = lattice.cells;
  body.voxels.size = lattice.voxels();
  body.state = voxelize(closed, lattice);
  sample_skin(skin, body);
  spread_bones(skin, body);
  find_parts(different_limbs, body);
  find_links(different_limbs, body);
  return body;
}

ControlMesh mesh_in_lattice(const Skeleton& skeleton, const SkinnedMesh& skin, const TriangleSoup& closed, double least_fill,
                            const Lattice& lattice) {
  const LimbTable different_limbs = bones_of_different_limbs(skeleton);
  Partition body = partition_body(different_limbs, skin, closed, lattice);
  const Eigen::VectorXi bones = dominant_bones(skin);
  std::vector<int> vertex_parts;
  for (Eigen::Index v = 0; v < skin.vertices.cols(); ++v)
    vertex_parts.push_back(part_at(body, different_limbs, skin.vertices.col(v), bones[v]));
  drop_slivers(vertex_parts, skin, least_fill, body);
  ControlMesh mesh;
  mesh.bridged_cells = join_pieces(body);
  const Cells cells = number_cells(body);
  cut_into_tets(body, cells, mesh);
  mesh.pieces = count_pieces(mesh.tets);
  assign_vertices(vertex_parts, skin, body, cells, mesh);
  mesh.bone_weights = spread_bone_weights(skeleton, skin, body, cells, mesh);
  return mesh;
}

/// How ill a lattice suits: nodes off the wanted number, cells that the body does not fill, cells far from cubes. Lower is
/// better. Well-filled cells are what makes a limb one or two whole cells wide.
double misfit(double nodes, double mean_fill, const Eigen::Vector3d& cell_size, const BodyOptions& options) {
  constexpr double kUsual = 200, kFewest = 100, kMost = 600;
  const double wanted = options.nodes > 0 ? options.nodes : kUsual;
  const double count = std::abs(std::log(nodes / wanted)) * (options.nodes > 0 ? 3.0 : 0.5);
  const double range =
      options.nodes > 0 ? 0 : 10 * (std::max(0.0, std::log(kFewest / nodes)) + std::max(0.0, std::log(nodes / kMost)));
  return count + range + (1 - mean_fill) + 0.3 * std::log(cell_size.maxCoeff() / cell_size.minCoeff());
}

/// Nodes and mean fill that a lattice would have, counted on the middles of voxels that another lattice marked: within a few
/// per cent.
std::pair<double, double> estimated_body(const std::vector<Eigen::Vector3d>& middles, double voxel_volume,
                                         const Lattice& lattice, double least_fill) {
  const Box cells{lattice.cells};
  const Box planes{lattice.cells.array() + 1};
  std::vector<double> fill(static_cast<std::size_t>(cells.count()), 0);
  for (const Eigen::Vector3d& middle : middles) {
    const Eigen::Vector3d place = (middle - lattice.origin).cwiseQuotient(lattice.cell_size);
    at(fill,
       cells.index(place.cast<int>().cwiseMax(0).cwiseMin(lattice.cells.array().matrix() - Eigen::Vector3i::Ones()))) +=
        voxel_volume / lattice.cell_size.prod();
  }
  std::vector<bool> used(static_cast<std::size_t>(planes.count()), false);
  double sum = 0;
  int kept = 0;
  for (int c = 0; c < cells.count(); ++c) {
    if (at(fill, c) < least_fill) continue;
    sum += std::min(1.0, at(fill, c));
    ++kept;
    for (int k = 0; k < 8; ++k) used[static_cast<std::size_t>(planes.index(cells.place(c) + corner_step(k)))] = true;
  }
  return {static_cast<double>(std::count(used.begin(), used.end(), true)), kept ? sum / kept : 0};
}

/// Lattices of near-cubic cells that span the box, the best-suited first.
std::vector<Eigen::Vector3i> ranked_lattices(const SkinnedMesh& skin, const TriangleSoup& closed,
                                             const BodyOptions& options) {
  constexpr double kRoughVoxels = 120;  // along the longest side
  constexpr double kLongestCell = 1.4;  // over the shortest side
  const Eigen::Vector3d size = skin.vertices.rowwise().maxCoeff() - skin.vertices.rowwise().minCoeff();
  const double longest = size.maxCoeff();
  const Eigen::Vector3i rough_cells = (size * (kRoughVoxels / longest)).array().ceil().cwiseMax(1).cast<int>();
  const Lattice rough = fitted_lattice(skin, rough_cells, 1);
  const std::vector<Voxel> state = voxelize(closed, rough);
  const Box box{rough_cells};
  std::vector<Eigen::Vector3d> middles;
  for (int v = 0; v < box.count(); ++v) {
    if (at(state, v) != Voxel::outside)
      middles.push_back(rough.origin + rough.cell_size.cwiseProduct((box.place(v).cast<double>().array() + 0.5).matrix()));
  }

  std::set<std::array<int, 3>> tried;
  std::vector<std::pair<double, std::array<int, 3>>> ranked;
  const double wanted = options.nodes > 0 ? options.nodes : 600;
  for (double along = 1; along <= wanted / 3; along = std::max(along + 0.25, along * 1.01)) {
    const Eigen::Vector3d exact = size * (along / longest);
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i cells = (exact.array().floor().cast<int>() + corner_step(corner).array()).cwiseMax(1);
      if (!tried.insert({cells[0], cells[1], cells[2]}).second) continue;
      const Lattice lattice = fitted_lattice(skin, cells, 1);
      if (lattice.cell_size.maxCoeff() > kLongestCell * lattice.cell_size.minCoeff() * (1 + 1e-9)) continue;
      const auto [nodes, fill] = estimated_body(middles, rough.cell_size.prod(), lattice, options.least_fill);
      if (nodes > 0) ranked.push_back({misfit(nodes, fill, lattice.cell_size, options), {cells[0], cells[1], cells[2]}});
      if (nodes > 4 * wanted) along = wanted;  // finer lattices only have more
    }
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<Eigen::Vector3i> best;
  for (const auto& [score, cells] : ranked) best.emplace_back(cells[0], cells[1], cells[2]);
  return best;
}

void refuse_empty(const SkinnedMesh& skin) {
  if (skin.triangles.cols() == 0 || skin.vertices.cols() == 0)
    throw Error("", "mesh", "the skin has no triangles, so there is no body to fill",
                "Export the clip together with its skinned mesh.");
  if (!skin.vertices.allFinite())
    throw Error("", "mesh", "a vertex is not a finite number", "Export the mesh again; its vertex positions are damaged.");
  if (!((skin.vertices.rowwise().maxCoeff() - skin.vertices.rowwise().minCoeff()).maxCoeff() > 0))
    throw Error("", "mesh", "all vertices lie at one point, so the body has no extent",
                "Give the mesh a size other than 0.");
}

}  // namespace

std::string broken_rule(const BodyOptions& options) {
  if (options.nodes != 0 && (options.nodes < 20 || options.nodes > 5000))
    return "nodes must be 0 (automatic) or from 20 to 5000";
  if ((options.lattice.array() != 0).any() && (options.lattice.array() < 1).any())
    return "lattice must have at least one cell along each axis";
  if (options.lattice.cast<double>().prod() > 20000) return "lattice must have at most 20000 cells";
  if (!(options.least_fill >= 0 && options.least_fill <= 0.5)) return "least_fill must be from 0 to 0.5";
  return "";
}

ControlMesh build_control_mesh(const Skeleton& skeleton, const SkinnedMesh& skin, const BodyOptions& options) {
  refuse_empty(skin);
  constexpr int kFine = 10;
  const TriangleSoup closed = with_closed_holes(skin.vertices, skin.triangles);
  const std::vector<Eigen::Vector3i> lattices =
      options.lattice.isZero() ? ranked_lattices(skin, closed, options) : std::vector<Eigen::Vector3i>{options.lattice};
  const std::size_t tries = std::min<std::size_t>(3, lattices.size());
  ControlMesh best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < tries; ++i) {
    ControlMesh mesh = mesh_in_lattice(skeleton, skin, closed, options.least_fill, fitted_lattice(skin, lattices[i], kFine));
    const double score = misfit(mesh.node_count(), mesh.tet_fill.mean(), mesh.cell_size, options);
    if (score >= least) continue;
    least = score;
    best = std::move(mesh);
  }
  assert(best.pieces == 1);
  return best;
}

int count_pieces(const Eigen::Matrix4Xi& tets) {
  Sets sets(static_cast<int>(tets.cols()));
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

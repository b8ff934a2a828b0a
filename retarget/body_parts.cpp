#include "retarget/body_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "retarget/disjoint_sets.h"

namespace hydrostat::retarget {
namespace {

constexpr double kCrumb = 0.06;  // share of a cell below which a part is no part of its own

bool may_touch(const BodyVoxels& body, const LimbTable& different_limbs, int a, int b) {
  const int bone_a = at(body.bone, a);
  const int bone_b = at(body.bone, b);
  return bone_a == kNone || bone_b == kNone || !different_limbs(bone_a, bone_b);
}

/// The connected voxels within each cell as sets of voxels, crumbs given to what they touch, and the fill of each at its
/// root.
DisjointSets connect_voxels(const BodyVoxels& body, const LimbTable& different_limbs, std::vector<double>& fill) {
  const double voxel_share = 1.0 / std::pow(body.lattice.fine, 3);
  DisjointSets sets(body.voxels.count());
  auto for_cellmates = [&](const auto& visit) {
    for (int v = 0; v < body.voxels.count(); ++v) {
      if (!body.is_body(v)) continue;
      for_neighbours(body.voxels, v, [&](int w) {
        if (w > v && body.is_body(w) && body.cell_of(w) == body.cell_of(v)) visit(v, w);
      });
    }
  };
  for_cellmates([&](int v, int w) {
    if (may_touch(body, different_limbs, v, w)) sets.join(v, w);
  });
  fill.assign(body.state.size(), 0);
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (body.is_body(v)) at(fill, sets.root(v)) += voxel_share * voxel_fill(body, v);
  }
  for_cellmates([&](int v, int w) {
    const int a = sets.root(v), b = sets.root(w);
    if (a == b || std::min(at(fill, a), at(fill, b)) >= kCrumb) return;
    const double sum = at(fill, a) + at(fill, b);
    sets.join(a, b);
    at(fill, sets.root(a)) = sum;
  });
  return sets;
}

/// Numbers the sets of voxels in the order of their first voxel.
void number_parts(const BodyVoxels& body, const LimbTable& different_limbs, BodyParts& parts) {
  std::vector<double> fill;
  DisjointSets sets = connect_voxels(body, different_limbs, fill);
  parts.part_of.assign(body.state.size(), kNone);
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (!body.is_body(v)) continue;
    const int root = sets.root(v);
    if (root == v) {  // the least of its set, so the first to come
      at(parts.part_of, v) = parts.count();
      parts.parts.push_back({body.cell_of(v), std::min(1.0, at(fill, v))});
    } else {
      at(parts.part_of, v) = at(parts.part_of, root);
    }
  }
}

/// Calls visit(v, w, axis) for the pairs of voxels that touch across a face of two cells, straight or askew, v the lower
/// one.
template <typename Visit>
void for_touches(const BodyVoxels& body, const Visit& visit) {
  const int fine = body.lattice.fine;
  for (int v = 0; v < body.voxels.count(); ++v) {
    if (!body.is_body(v)) continue;
    const Eigen::Vector3i here = body.voxels.place(v);
    for (int axis = 0; axis < 3; ++axis) {
      if (here[axis] % fine != fine - 1) continue;
      const int first = (axis + 1) % 3, second = (axis + 2) % 3;
      for (int askew = 0; askew < 9; ++askew) {
        Eigen::Vector3i next = here;
        next[axis] += 1;
        next[first] += askew / 3 - 1;
        next[second] += askew % 3 - 1;
        if (!body.voxels.holds(next) || !body.is_body(body.voxels.index(next))) continue;
        if (next[first] / fine == here[first] / fine && next[second] / fine == here[second] / fine)
          visit(v, body.voxels.index(next), axis);
      }
    }
  }
}

/// A touch that is small for both parts is left out: where two limbs' skins coincide, a few voxels of each are taken for the
/// other's.
void link_parts(const BodyVoxels& body, const LimbTable& different_limbs, BodyParts& parts) {
  constexpr double kSmall = 0.2;  // touching voxels over the most that the part has across that face
  std::map<Link, int> touches;
  for_touches(body, [&](int v, int w, int axis) {
    if (may_touch(body, different_limbs, v, w)) ++touches[{at(parts.part_of, v), at(parts.part_of, w), axis}];
  });
  std::map<std::pair<int, int>, int> most_above, most_below;  // per part and axis
  for (const auto& [link, count] : touches) {
    int& above = most_above[{link.low, link.axis}];
    int& below = most_below[{link.high, link.axis}];
    above = std::max(above, count);
    below = std::max(below, count);
  }
  for (const auto& [link, count] : touches) {
    if (count >= kSmall * std::min(most_above[{link.low, link.axis}], most_below[{link.high, link.axis}]))
      parts.links.insert(link);
  }
}

int part_at(const BodyVoxels& body, const BodyParts& parts, const LimbTable& different_limbs, const Eigen::Vector3d& point,
            int bone) {
  const int voxel = body.voxel_at(point);
  int best = kNone;
  std::pair<bool, double> least{true, std::numeric_limits<double>::infinity()};
  auto offer = [&](int candidate) {
    if (at(parts.part_of, candidate) == kNone) return;
    const bool is_other_limb = at(body.bone, candidate) != kNone && different_limbs(at(body.bone, candidate), bone);
    const std::pair<bool, double> price{is_other_limb,
                                        candidate == voxel ? 0 : (body.middle(candidate) - point).squaredNorm()};
    if (price >= least) return;
    least = price;
    best = at(parts.part_of, candidate);
  };
  offer(voxel);
  for_neighbours(body.voxels, voxel, offer,
                 /*reach=*/2);  // where two limbs' skins touch, one of them owns the voxels on both sides
  return best;
}

}  // namespace

BodyParts find_parts(const BodyVoxels& body, const LimbTable& different_limbs) {
  BodyParts parts;
  number_parts(body, different_limbs, parts);
  link_parts(body, different_limbs, parts);
  return parts;
}

std::vector<int> parts_of_vertices(const BodyVoxels& body, const BodyParts& parts, const LimbTable& different_limbs,
                                   const SkinnedMesh& skin) {
  const Eigen::VectorXi bones = dominant_bones(skin);
  std::vector<int> vertex_parts;
  for (Eigen::Index v = 0; v < skin.vertices.cols(); ++v)
    vertex_parts.push_back(part_at(body, parts, different_limbs, skin.vertices.col(v), bones[v]));
  return vertex_parts;
}

void drop_slivers(const BodyVoxels& body, const std::vector<int>& vertex_parts, const SkinnedMesh& skin, double least_fill,
                  BodyParts& parts) {
  std::vector<std::vector<int>> hosts(parts.parts.size());
  for (const Link& link : parts.links) {
    if (at(parts.parts, link.high).fill >= least_fill) at(hosts, link.low).push_back(link.high);
    if (at(parts.parts, link.low).fill >= least_fill) at(hosts, link.high).push_back(link.low);
  }
  auto lies_on_a_host = [&](int part, const Eigen::Vector3d& point, double reach) {
    return std::any_of(at(hosts, part).begin(), at(hosts, part).end(),
                       [&](int host) { return cells_outside(body, point, at(parts.parts, host).cell) <= reach; });
  };
  std::vector<bool> is_sliver(parts.parts.size());
  for (std::size_t p = 0; p < is_sliver.size(); ++p) is_sliver[p] = parts.parts[p].fill < least_fill && !hosts[p].empty();
  for (int v = 0; v < body.voxels.count(); ++v) {
    const int part = at(parts.part_of, v);
    if (part != kNone && at(is_sliver, part) && !lies_on_a_host(part, body.middle(v), least_fill + 0.5 / body.lattice.fine))
      at(is_sliver, part) = false;
  }
  for (int v = 0; v < skin.vertices.cols(); ++v) {
    const int part = at(vertex_parts, v);
    if (part != kNone && at(is_sliver, part) && !lies_on_a_host(part, skin.vertices.col(v), least_fill))
      at(is_sliver, part) = false;
  }
  for (std::size_t p = 0; p < is_sliver.size(); ++p) parts.parts[p].kept = !is_sliver[p];
}

}  // namespace hydrostat::retarget

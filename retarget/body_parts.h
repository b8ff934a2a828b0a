#pragma once

#include <set>
#include <utility>
#include <vector>

#include "retarget/body_voxels.h"
#include "retarget/limbs.h"

namespace hydrostat::retarget {

/// The part of the body that one cell holds in one piece.
struct Part {
  int cell;     // index in the grid of cells
  double fill;  // share of the cell
  bool kept = true;
};

/// Two parts in neighbouring cells, the second one step further along the axis, that touch across the face between.
struct Link {
  int low, high, axis;

  auto operator<=>(const Link&) const = default;
};

/// What each cell holds of the body.
struct BodyParts {
  std::vector<Part> parts;
  std::vector<int> part_of;  // per voxel; kNone where there is no body
  std::set<Link> links;
  std::vector<std::pair<int, int>> merges;  // parts of one cell that become one

  int count() const { return static_cast<int>(parts.size()); }
};

/// Parts are the connected voxels within a cell; voxels of different limbs are not connected, even where they touch. Crumbs
/// that the border between two limbs leaves are given to what they touch. Parts in neighbouring cells are linked where their
/// voxels touch across the common face.
BodyParts find_parts(const BodyVoxels& body, const LimbTable& different_limbs);

/// The part of each skin vertex: of the voxel that holds it, or of the nearest around it where that is air or another
/// limb's; kNone where there is none. V.
std::vector<int> parts_of_vertices(const BodyVoxels& body, const BodyParts& parts, const LimbTable& different_limbs,
                                   const SkinnedMesh& skin);

/// Drops the parts that are a thin layer on a fuller neighbour: skin that lies on the border of two cells, give or take a
/// voxel. `least_fill` is that of BodyOptions.
void drop_slivers(const BodyVoxels& body, const std::vector<int>& vertex_parts, const SkinnedMesh& skin, double least_fill,
                  BodyParts& parts);

}  // namespace hydrostat::retarget

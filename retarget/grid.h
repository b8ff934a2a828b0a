#pragma once

#include <Eigen/Core>

namespace hydrostat::retarget {

/// The places of a box of whole numbers, from 0 to size - 1 along each axis, counted with x fastest, z slowest.
struct Grid {
  Eigen::Vector3i size;

  int count() const { return size.prod(); }
  bool holds(const Eigen::Vector3i& place) const {
    return (place.array() >= 0).all() && (place.array() < size.array()).all();
  }
  /// The place of the grid that lies nearest.
  Eigen::Vector3i held(const Eigen::Vector3i& place) const {
    return place.cwiseMax(0).cwiseMin((size.array() - 1).matrix());
  }
  int index(const Eigen::Vector3i& place) const { return place[0] + size[0] * (place[1] + size[1] * place[2]); }
  Eigen::Vector3i place(int index) const { return {index % size[0], index / size[0] % size[1], index / size[0] / size[1]}; }
};

/// Corner k of a cell, 0 to 7, is its lowest corner moved by the bits of k along x, y and z.
inline Eigen::Vector3i corner_step(int corner) { return {corner & 1, corner >> 1 & 1, corner >> 2 & 1}; }

/// Calls visit(neighbour) for the places of the grid that are within `reach` of this one along each axis, this one left out:
/// 1 are those that touch it.
template <typename Visit>
void for_neighbours(const Grid& grid, int index, const Visit& visit, int reach = 1) {
  const Eigen::Vector3i here = grid.place(index);
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Eigen::Vector3i next = here + Eigen::Vector3i(x, y, z);
        if ((x || y || z) && grid.holds(next)) visit(grid.index(next));
      }
    }
  }
}

/// Calls visit(neighbour) for the places of the grid that share a face with this one.
template <typename Visit>
void for_face_neighbours(const Grid& grid, int index, const Visit& visit) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      Eigen::Vector3i next = grid.place(index);
      next[axis] += step;
      if (grid.holds(next)) visit(grid.index(next));
    }
  }
}

}  // namespace hydrostat::retarget

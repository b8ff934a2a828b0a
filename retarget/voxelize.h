#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace hydrostat::retarget {

/// A box of cells, each cut into `fine` voxels along each axis. Cells and voxels are counted with x fastest, z slowest.
struct Lattice {
  Eigen::Vector3d origin;     // [m] lowest corner
  Eigen::Vector3d cell_size;  // [m]
  Eigen::Vector3i cells;      // along x, y, z
  int fine = 10;              // voxels a cell and axis

  Eigen::Vector3i voxels() const { return cells * fine; }
  Eigen::Vector3d voxel_size() const { return cell_size / fine; }
};

enum class Voxel : std::uint8_t { outside, skin, inside };

/// A triangle soup of its own vertices [m]; any order, any orientation.
struct TriangleSoup {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi triangles;
};

/// The skin with its holes closed by fans about their middles, so that an open mesh has an inside. Vertices are welded first
/// (exporters part them at seams); orientation does not matter. A hole wider than half the area of its shell is the rim of a
/// sheet and stays open. The given triangles come first, in their order.
TriangleSoup with_closed_holes(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles);

/// Marks the voxels of the lattice: skin where the centre lies within half a voxel of a triangle (no six-connected path
/// slips through), inside where no path leads out. Shells may be open, inside out, overlapping or many: their union is the
/// body. Returns one entry per voxel, x fastest.
std::vector<Voxel> voxelize(const TriangleSoup& soup, const Lattice& lattice);

}  // namespace hydrostat::retarget

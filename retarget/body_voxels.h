#pragma once

#include <Eigen/Core>
#include <vector>

#include "retarget/at.h"
#include "retarget/clip.h"
#include "retarget/grid.h"
#include "retarget/voxelize.h"

namespace hydrostat::retarget {

/// A point of the skin, as a mean of a triangle's corners.
struct SkinSample {
  int triangle = kNone;
  Eigen::Vector3d shares = Eigen::Vector3d::Zero();
};

/// The body in voxels, and the bone that each belongs to.
struct BodyVoxels {
  Lattice lattice;
  Grid cells, voxels;
  std::vector<Voxel> state;        // per voxel
  std::vector<SkinSample> sample;  // per voxel; the skin point nearest to its middle
  std::vector<int> bone;           // per voxel; kNone where there is no body

  bool is_body(int voxel) const { return at(state, voxel) != Voxel::outside; }
  int cell_of(int voxel) const { return cells.index(voxels.place(voxel) / lattice.fine); }
  Eigen::Vector3d middle(int voxel) const {
    return lattice.origin + lattice.voxel_size().cwiseProduct((voxels.place(voxel).cast<double>().array() + 0.5).matrix());
  }
  /// The voxel that holds a point [m], or lies nearest to it.
  int voxel_at(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d place = (point - lattice.origin).cwiseQuotient(lattice.voxel_size());
    return voxels.index(voxels.held(place.array().floor().cast<int>().matrix()));
  }
};

/// Voxels of a skin in its bind pose; `closed` is the skin with its holes closed. Each voxel of the body belongs to the main
/// bone of the skin nearest to it through the body.
BodyVoxels body_voxels(const SkinnedMesh& skin, const TriangleSoup& closed, const Lattice& lattice);

/// Skin weights at a sample, as pairs of bone and weight that sum to 1; a bone may come more than once.
std::vector<SkinnedMesh::Influence> weights_at(const SkinnedMesh& skin, const SkinSample& sample);

/// Share of a voxel that the body fills: of the skin's, as many as its neighbours by faces that lie inside rather than
/// outside.
double voxel_fill(const BodyVoxels& body, int voxel);

/// How far [cells, the largest of the three] a point [m] lies outside a cell; 0 within.
double cells_outside(const BodyVoxels& body, const Eigen::Vector3d& point, int cell);

}  // namespace hydrostat::retarget

#include "retarget/choose_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include "retarget/at.h"
#include "retarget/grid.h"

namespace hydrostat::retarget {
namespace {

/// Nodes and mean fill that a lattice would have, counted on the middles of voxels that another lattice marked.
std::pair<double, double> estimated_body(const std::vector<Eigen::Vector3d>& middles, double voxel_volume,
                                         const Lattice& lattice, double least_fill) {
  const Grid cells{lattice.cells};
  const Grid planes{lattice.cells.array() + 1};
  std::vector<double> fill(static_cast<std::size_t>(cells.count()), 0);
  for (const Eigen::Vector3d& middle : middles) {
    const Eigen::Vector3d place = (middle - lattice.origin).cwiseQuotient(lattice.cell_size);
    at(fill, cells.index(cells.held(place.cast<int>()))) += voxel_volume / lattice.cell_size.prod();
  }
  std::vector<bool> used(static_cast<std::size_t>(planes.count()), false);
  double sum = 0;
  int kept = 0;
  for (int c = 0; c < cells.count(); ++c) {
    if (at(fill, c) < least_fill) continue;
    sum += std::min(1.0, at(fill, c));
    ++kept;
    for (int k = 0; k < 8; ++k) at(used, planes.index(cells.place(c) + corner_step(k))) = true;
  }
  return {static_cast<double>(std::count(used.begin(), used.end(), true)), kept ? sum / kept : 0};
}

/// The middles of the cells of a lattice that hold any of the body.
std::vector<Eigen::Vector3d> body_middles(const TriangleSoup& closed, const Lattice& lattice) {
  const std::vector<Voxel> state = voxelize(closed, lattice);
  const Grid voxels{lattice.cells};
  std::vector<Eigen::Vector3d> middles;
  for (int v = 0; v < voxels.count(); ++v) {
    if (at(state, v) == Voxel::outside) continue;
    const Eigen::Vector3d place = voxels.place(v).cast<double>().array() + 0.5;
    middles.push_back(lattice.origin + lattice.cell_size.cwiseProduct(place));
  }
  return middles;
}

}  // namespace

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

double misfit(const LatticeBody& body, const BodyOptions& options) {
  constexpr double kUsual = 200, kFewest = 100, kMost = 600;
  constexpr double kThreeAcross = 0.9;  // as ill as a third more nodes than wished
  const double wanted = options.nodes > 0 ? options.nodes : kUsual;
  const double count = std::abs(std::log(body.nodes / wanted)) * (options.nodes > 0 ? 3.0 : 0.5);
  const double range =
      options.nodes > 0 ? 0 : 10 * (std::max(0.0, std::log(kFewest / body.nodes)) + std::max(0.0, std::log(body.nodes / kMost)));
  const double lopsided = options.mirror_axis && body.cells[*options.mirror_axis] == 3 ? kThreeAcross : 0;
  return count + range + (1 - body.fill) + 0.3 * std::log(body.cell_size.maxCoeff() / body.cell_size.minCoeff()) + lopsided;
}

std::vector<LatticeBody> ranked_lattices(const SkinnedMesh& skin, const TriangleSoup& closed, const BodyOptions& options) {
  constexpr double kRoughVoxels = 120;  // along the longest side
  constexpr double kLongestCell = 1.4;  // over the shortest side
  constexpr double kMostNodes = 5000;
  const Eigen::Vector3d size = skin.vertices.rowwise().maxCoeff() - skin.vertices.rowwise().minCoeff();
  const double longest = size.maxCoeff();
  const Eigen::Vector3i rough_cells = (size * (kRoughVoxels / longest)).array().ceil().cwiseMax(1).cast<int>();
  const Lattice rough = fitted_lattice(skin, rough_cells, 1);
  const std::vector<Eigen::Vector3d> middles = body_middles(closed, rough);

  std::set<std::array<int, 3>> tried;
  std::vector<LatticeBody> ranked;
  const double wanted = options.nodes > 0 ? options.nodes : 600;
  // A body that is longer and thinner than that takes more nodes than wanted, up to as many as there may be.
  const auto is_sought = [&](double along) { return along <= wanted / 3 || (ranked.empty() && along <= kMostNodes / 3); };
  for (double along = 1; is_sought(along); along = std::max(along + 0.25, along * 1.01)) {
    const Eigen::Vector3d exact = size * (along / longest);
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i cells = (exact.array().floor().cast<int>() + corner_step(corner).array()).cwiseMax(1);
      if (!tried.insert({cells[0], cells[1], cells[2]}).second) continue;
      const Lattice lattice = fitted_lattice(skin, cells, 1);
      if (lattice.cell_size.maxCoeff() > kLongestCell * lattice.cell_size.minCoeff() * (1 + 1e-9)) continue;
      const auto [nodes, fill] = estimated_body(middles, rough.cell_size.prod(), lattice, options.least_fill);
      if (nodes > 0) ranked.push_back({cells, lattice.cell_size, nodes, fill});
      if (nodes > 4 * wanted) along = wanted;  // finer lattices only have more
    }
  }
  const auto rank = [&](const LatticeBody& body) {
    return std::tuple(misfit(body, options), body.cells[0], body.cells[1], body.cells[2]);
  };
  std::sort(ranked.begin(), ranked.end(), [&](const LatticeBody& a, const LatticeBody& b) { return rank(a) < rank(b); });
  return ranked;
}

}  // namespace hydrostat::retarget

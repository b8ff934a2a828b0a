#include "retarget/control_mesh.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <vector>

#include "retarget/body_parts.h"
#include "retarget/choose_lattice.h"
#include "retarget/cut_into_tets.h"
#include "retarget/error.h"
#include "retarget/join_pieces.h"
#include "retarget/number_cells.h"
#include "retarget/spread_bone_weights.h"

namespace hydrostat::retarget {
namespace {

ControlMesh mesh_in_lattice(const Skeleton& skeleton, const SkinnedMesh& skin, const TriangleSoup& closed, double least_fill,
                            const Lattice& lattice) {
  const LimbTable different_limbs = bones_of_different_limbs(skeleton);
  const BodyVoxels body = body_voxels(skin, closed, lattice);
  BodyParts parts = find_parts(body, different_limbs);
  if (parts.parts.empty())
    throw Error("", "mesh", "the body is too thin to be filled", "Thicken it, or ask for more control nodes.");
  const std::vector<int> vertex_parts = parts_of_vertices(body, parts, different_limbs, skin);
  drop_slivers(body, vertex_parts, skin, least_fill, parts);
  ControlMesh mesh;
  mesh.bridged_cells = join_pieces(body.cells, parts);
  const BodyCells cells = number_cells(body.cells, parts);
  cut_into_tets(lattice, cells, mesh);
  mesh.vertex_cells = cells_of_vertices(body, parts, cells, vertex_parts, skin);
  mesh.bone_weights = spread_bone_weights(skeleton, skin, body, parts, cells, mesh);
  return mesh;
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
  if (options.mirror_axis && *options.mirror_axis != 0 && *options.mirror_axis != 2) return "mirror_axis must be 0 or 2";
  if (!(options.least_fill >= 0 && options.least_fill <= 0.5)) return "least_fill must be from 0 to 0.5";
  return "";
}

ControlMesh build_control_mesh(const Skeleton& skeleton, const SkinnedMesh& skin, const BodyOptions& options) {
  refuse_empty(skin);
  constexpr int kFine = 10;
  constexpr int kTries = 3, kMostTries = 8;  // of lattices; beyond the first only while a wished number is foreseen to be met better
  const TriangleSoup closed = with_closed_holes(skin.vertices, skin.triangles);
  std::vector<LatticeBody> lattices = options.lattice.isZero()
                                          ? ranked_lattices(skin, closed, options)
                                          : std::vector<LatticeBody>{{options.lattice, Eigen::Vector3d::Ones(), 1, 1}};
  if (lattices.empty())
    throw Error("", "mesh", "the body is too long and thin for 5000 control nodes", "Shorten or thicken it.");
  ControlMesh best;
  double least = std::numeric_limits<double>::infinity();
  double nodes_per_estimated = 1;  // of a wished number, as the last one tried has it
  const auto foreseen = [&](LatticeBody body) {
    body.nodes *= nodes_per_estimated;
    return misfit(body, options);
  };
  for (int tries = 0; !lattices.empty() && tries < kMostTries; ++tries) {
    const auto next = std::min_element(lattices.begin(), lattices.end(),
                                       [&](const LatticeBody& a, const LatticeBody& b) { return foreseen(a) < foreseen(b); });
    if (tries >= kTries && (options.nodes == 0 || foreseen(*next) >= least)) break;
    ControlMesh mesh = mesh_in_lattice(skeleton, skin, closed, options.least_fill, fitted_lattice(skin, next->cells, kFine));
    if (options.nodes > 0) nodes_per_estimated = mesh.node_count() / next->nodes;
    const double score = misfit({next->cells, mesh.cell_size, static_cast<double>(mesh.node_count()), mesh.tet_fill.mean()}, options);
    lattices.erase(next);
    if (score >= least) continue;
    least = score;
    best = std::move(mesh);
  }
  assert(best.pieces == 1);
  return best;
}

}  // namespace hydrostat::retarget

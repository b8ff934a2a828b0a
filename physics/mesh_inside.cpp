#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "physics/simplex_mesh.h"

namespace hydrostat::physics {
namespace {

constexpr double kSnap = 0.35;          // of the spacing: nodes nearer to the surface are moved onto it
constexpr double kOnSurface = 1e-9;     // of the spacing
constexpr double kCorner = 0.35;        // [rad]
constexpr double kLeastQualityOfCorner = 0.2;
constexpr double kLeastQuality = 0.02;  // of a simplex that touches the surface all over: flatter ones are left out
constexpr double kFolded = 1e-6;        // where parts are thinner than a cell, snapping may turn a simplex inside out

template <int Dim>
using Index = Eigen::Matrix<int, Dim, 1>;
template <int Dim>
using Simplex = Eigen::Matrix<int, Dim + 1, 1>;

/// A mesh that is being cut; `distance` [m] to the surface is 0 for what lies on it, negative inside.
template <int Dim>
struct Draft {
  std::vector<VectorOf<Dim>> nodes;
  std::vector<double> distance;
  std::vector<Simplex<Dim>> simplices;

  int side(int node) const {
    const double d = distance[static_cast<std::size_t>(node)];
    return d < 0 ? -1 : d > 0 ? 1 : 0;
  }
};

/// The lattice that spans the surface's box and one cell more on every side.
template <int Dim>
Draft<Dim> lattice_around(const ClosedMeshOf<Dim>& surface, double cell, VectorOf<Dim>& step) {
  const VectorOf<Dim> size = surface.high() - surface.low();
  const Index<Dim> cells = (size / cell).array().ceil().max(1).template cast<int>();
  step = size.cwiseQuotient(cells.template cast<double>());
  SimplexMeshOf<Dim> mesh = mesh_of_box<Dim>(step.cwiseProduct((cells.array() + 2).matrix().template cast<double>()),
                                             (cells.array() + 2).matrix());
  mesh.nodes.colwise() += (surface.high() + surface.low()) / 2;
  Draft<Dim> draft;
  for (Eigen::Index n = 0; n < mesh.nodes.cols(); ++n) draft.nodes.push_back(mesh.nodes.col(n));
  for (Eigen::Index t = 0; t < mesh.simplices.cols(); ++t) draft.simplices.push_back(mesh.simplices.col(t));
  return draft;
}

template <int Dim>
SimplexMeshOf<Dim> alone(const Draft<Dim>& draft, const Simplex<Dim>& simplex) {
  SimplexMeshOf<Dim> mesh{PointsOf<Dim>(Dim, Dim + 1), Simplex<Dim>::LinSpaced(0, Dim)};
  for (int k = 0; k <= Dim; ++k) mesh.nodes.col(k) = draft.nodes[static_cast<std::size_t>(simplex[k])];
  return mesh;
}

/// The least quality of the simplices around a node.
template <int Dim>
double quality_around(const Draft<Dim>& draft, int node) {
  double least = 1;
  for (const Simplex<Dim>& simplex : draft.simplices) {
    if ((simplex.array() == node).any()) least = std::min(least, shape_qualities(alone(draft, simplex))[0]);
  }
  return least;
}

/// The corners of an outline that turn by more than kCorner.
std::vector<Eigen::Index> corners_of_outline(const ClosedMeshOf<2>& outline) {
  std::vector<Eigen::Vector2d> into(static_cast<std::size_t>(outline.vertices().cols())), out_of(into.size());
  for (Eigen::Index f = 0; f < outline.faces().cols(); ++f) {
    const int from = outline.faces()(0, f), to = outline.faces()(1, f);
    const Eigen::Vector2d way = (outline.vertices().col(to) - outline.vertices().col(from)).normalized();
    out_of[static_cast<std::size_t>(from)] = into[static_cast<std::size_t>(to)] = way;
  }
  std::vector<Eigen::Index> corners;
  for (std::size_t v = 0; v < into.size(); ++v) {
    if (into[v].dot(out_of[v]) < std::cos(kCorner)) corners.push_back(static_cast<Eigen::Index>(v));
  }
  return corners;
}

/// In 2D, each corner of the outline takes the nearest node that no other has, where that keeps the triangles good.
template <int Dim>
void take_corners(const ClosedMeshOf<Dim>& surface, double reach, Draft<Dim>& draft, std::vector<char>& taken) {
  if constexpr (Dim == 2) {
    for (const Eigen::Index c : corners_of_outline(surface)) {
      const VectorOf<Dim> corner = surface.vertices().col(c);
      int nearest = -1;
      double least = reach;
      for (std::size_t n = 0; n < draft.nodes.size(); ++n) {
        const double distance = (draft.nodes[n] - corner).norm();
        if (!taken[n] && distance < least) nearest = static_cast<int>(n), least = distance;
      }
      if (nearest < 0) continue;
      const VectorOf<Dim> before = std::exchange(draft.nodes[static_cast<std::size_t>(nearest)], corner);
      if (quality_around(draft, nearest) > kLeastQualityOfCorner) {
        taken[static_cast<std::size_t>(nearest)] = 1;
      } else {
        draft.nodes[static_cast<std::size_t>(nearest)] = before;
      }
    }
  }
}

template <int Dim>
void snap(const ClosedMeshOf<Dim>& surface, double spacing, Draft<Dim>& draft, const std::vector<char>& taken) {
  draft.distance.resize(draft.nodes.size());
  for (std::size_t n = 0; n < draft.nodes.size(); ++n) {
    double& distance = draft.distance[n];
    distance = 0;
    if (taken[n]) continue;
    VectorOf<Dim> normal;
    distance = surface.signed_distance(draft.nodes[n], normal);
    if (std::abs(distance) > kSnap * spacing) continue;
    draft.nodes[n] -= distance * normal;
    distance = 0;
  }
}

/// Where the surface crosses the edge from node a to node b, which lie on different sides: by bisection.
template <int Dim>
VectorOf<Dim> crossing(const ClosedMeshOf<Dim>& surface, VectorOf<Dim> inside, VectorOf<Dim> outside, double spacing) {
  VectorOf<Dim> normal;
  while ((outside - inside).norm() > kOnSurface * spacing) {
    const VectorOf<Dim> middle = (inside + outside) / 2;
    (surface.signed_distance(middle, normal) < 0 ? inside : outside) = middle;
  }
  return (inside + outside) / 2;
}

/// Cuts all simplices that lie on both sides, edge by edge: neighbours cut their common face in the same order.
template <int Dim>
void cut(const ClosedMeshOf<Dim>& surface, double spacing, Draft<Dim>& draft) {
  std::map<std::pair<int, int>, int> crossing_of;
  std::vector<Simplex<Dim>> done;
  for (const Simplex<Dim>& whole : draft.simplices) {
    std::vector<std::pair<int, int>> cuts;
    for (int a = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b) {
        if (draft.side(whole[a]) * draft.side(whole[b]) < 0) cuts.push_back(std::minmax(whole[a], whole[b]));
      }
    }
    std::sort(cuts.begin(), cuts.end());
    std::vector<Simplex<Dim>> parts{whole};
    for (const std::pair<int, int>& edge : cuts) {
      const auto [entry, is_new] = crossing_of.try_emplace(edge, static_cast<int>(draft.nodes.size()));
      if (is_new) {
        const bool first_is_inside = draft.side(edge.first) < 0;
        const VectorOf<Dim> inside = draft.nodes[static_cast<std::size_t>(first_is_inside ? edge.first : edge.second)];
        const VectorOf<Dim> outside = draft.nodes[static_cast<std::size_t>(first_is_inside ? edge.second : edge.first)];
        draft.nodes.push_back(crossing<Dim>(surface, inside, outside, spacing));
        draft.distance.push_back(0);
      }
      std::vector<Simplex<Dim>> smaller;
      for (const Simplex<Dim>& part : parts) {
        if ((part.array() != edge.first).all() || (part.array() != edge.second).all()) {
          smaller.push_back(part);
          continue;
        }
        for (const int end : {edge.first, edge.second}) smaller.push_back((part.array() == end).select(entry->second, part));
      }
      parts = std::move(smaller);
    }
    done.insert(done.end(), parts.begin(), parts.end());
  }
  draft.simplices = std::move(done);
}

template <int Dim>
bool is_kept(const ClosedMeshOf<Dim>& surface, const Draft<Dim>& draft, const Simplex<Dim>& simplex) {
  bool touches_inside = false;
  for (const int node : simplex) {
    if (draft.side(node) > 0) return false;
    touches_inside = touches_inside || draft.side(node) < 0;
  }
  const SimplexMeshOf<Dim> mesh = alone(draft, simplex);
  const double quality = shape_qualities(mesh)[0];
  if (touches_inside) return quality > kFolded;
  VectorOf<Dim> normal;
  return quality > kLeastQuality && surface.signed_distance(mesh.nodes.rowwise().mean(), normal) < 0;
}

}  // namespace

template <int Dim>
SimplexMeshOf<Dim> mesh_inside(const ClosedMeshOf<Dim>& surface, double cell) {
  VectorOf<Dim> step;
  Draft<Dim> draft = lattice_around(surface, cell, step);
  const double spacing = step.minCoeff();
  std::vector<char> taken(draft.nodes.size(), 0);
  take_corners(surface, 0.75 * step.norm(), draft, taken);
  snap(surface, spacing, draft, taken);
  cut(surface, spacing, draft);
  std::map<int, int> number;
  std::vector<Simplex<Dim>> kept;
  for (const Simplex<Dim>& simplex : draft.simplices) {
    if (!is_kept(surface, draft, simplex)) continue;
    kept.push_back(simplex);
    for (const int node : simplex) number.try_emplace(node, 0);
  }
  SimplexMeshOf<Dim> mesh;
  mesh.nodes.resize(Dim, static_cast<Eigen::Index>(number.size()));
  int count = 0;
  for (auto& [node, place] : number) {
    mesh.nodes.col(count) = draft.nodes[static_cast<std::size_t>(node)];
    place = count++;
  }
  mesh.simplices.resize(Dim + 1, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t t = 0; t < kept.size(); ++t) {
    for (int k = 0; k <= Dim; ++k) mesh.simplices(k, static_cast<Eigen::Index>(t)) = number.at(kept[t][k]);
  }
  return mesh;
}

template SimplexMeshOf<2> mesh_inside<2>(const ClosedMeshOf<2>&, double);
template SimplexMeshOf<3> mesh_inside<3>(const ClosedMeshOf<3>&, double);

}  // namespace hydrostat::physics

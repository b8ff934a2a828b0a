#include "physics/self_contact.h"

#include <algorithm>
#include <map>

// What of a body may touch itself, settled once.

namespace hydrostat::physics {
namespace {

constexpr int kRings = 2;  // of neighbours along the mesh that never touch

}  // namespace

/// What is within two edges of a node, and, where the scene says so, what is near it in the rest shape.
template <int Dim>
void SelfContactSet<Dim>::find_neighbours() {
  const BodyOf<Dim>& body = scene_.body;
  const auto count = static_cast<std::size_t>(body.node_count());
  std::vector<std::vector<int>> linked(count);
  for (int e = 0; e < body.edge_count(); ++e) {
    linked[static_cast<std::size_t>(body.edges(0, e))].push_back(body.edges(1, e));
    linked[static_cast<std::size_t>(body.edges(1, e))].push_back(body.edges(0, e));
  }
  piece_.assign(count, -1);
  std::vector<int> reached;
  for (std::size_t n = 0; n < count; ++n) {
    if (piece_[n] >= 0) continue;
    piece_[n] = static_cast<int>(n);
    reached.assign(1, static_cast<int>(n));
    while (!reached.empty()) {
      const auto from = static_cast<std::size_t>(reached.back());
      reached.pop_back();
      for (const int to : linked[from]) {
        if (piece_[static_cast<std::size_t>(to)] >= 0) continue;
        piece_[static_cast<std::size_t>(to)] = static_cast<int>(n);
        reached.push_back(to);
      }
    }
  }
  near_.assign(points_.size() * count, false);
  const double near_at_rest = scene_.self_contact.near_at_rest;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const int node = points_[p];
    std::vector<int> near{node};
    for (int ring = 0; ring < kRings; ++ring) {
      for (std::size_t k = 0, known = near.size(); k < known; ++k) {
        const std::vector<int>& next = linked[static_cast<std::size_t>(near[k])];
        near.insert(near.end(), next.begin(), next.end());
      }
      std::sort(near.begin(), near.end());
      near.erase(std::unique(near.begin(), near.end()), near.end());
    }
    for (const int other : near) near_[p * count + static_cast<std::size_t>(other)] = true;
    for (int other = 0; near_at_rest > 0 && other < body.node_count(); ++other) {
      if ((body.rest.col(other) - body.rest.col(node)).norm() < near_at_rest)
        near_[p * count + static_cast<std::size_t>(other)] = true;
    }
  }
}

/// Nodes and faces of the surface that may meet any other.
template <int Dim>
void SelfContactSet<Dim>::find_surface() {
  const BodyOf<Dim>& body = scene_.body;
  const SelfContact& settings = scene_.self_contact;
  const auto meets_any = [&](int node) {
    return settings.region.size() == 0 || settings.meet.size() == 0 || settings.meet.col(settings.region[node]).any();
  };
  const std::vector<SurfaceFace> all = surface_faces(body);
  std::vector<char> is_point(static_cast<std::size_t>(body.node_count()), 0);
  faces_.resize(Dim, static_cast<Eigen::Index>(all.size()));
  for (const SurfaceFace& face : all) {
    const Eigen::Matrix<int, Dim, 1> nodes = nodes_of_face(body, face);
    if (std::none_of(nodes.begin(), nodes.end(), meets_any)) continue;
    for (const int node : nodes) is_point[static_cast<std::size_t>(node)] = 1;
    faces_.col(static_cast<Eigen::Index>(owners_.size())) = nodes;
    owners_.push_back(face);
  }
  faces_.conservativeResize(Dim, static_cast<Eigen::Index>(owners_.size()));
  point_of_.assign(static_cast<std::size_t>(body.node_count()), -1);
  for (int n = 0; n < body.node_count(); ++n) {
    if (!is_point[static_cast<std::size_t>(n)]) continue;
    point_of_[static_cast<std::size_t>(n)] = static_cast<int>(points_.size());
    points_.push_back(n);
  }
}

template <int Dim>
void SelfContactSet<Dim>::find_edges() {
  std::map<std::pair<int, int>, int> first_face;
  edge_begin_.assign(1, 0);
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    for (int k = 0; k < Dim; ++k) {
      const int a = faces_(k, f), b = faces_((k + 1) % Dim, f);
      const auto [entry, is_new] = first_face.try_emplace(std::minmax(a, b), static_cast<int>(f));
      if (is_new) continue;
      edges_.push_back({{a, b}, {entry->second, static_cast<int>(f)}});
    }
    edge_begin_.push_back(static_cast<int>(edges_.size()));
  }
}

#define HYDROSTAT_INSTANTIATE(Dim)                          \
  template void SelfContactSet<Dim>::find_neighbours(); \
  template void SelfContactSet<Dim>::find_surface();    \
  template void SelfContactSet<Dim>::find_edges();
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics

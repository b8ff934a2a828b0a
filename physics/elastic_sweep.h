#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "physics/body.h"
#include "physics/element_lanes.h"

namespace hydrostat::physics {

// The forces of edges and volumes, four at a time. Inner part of elastic_forces.cpp.

typedef double Pair __attribute__((vector_size(2 * sizeof(double))));  // NOLINT: attributes want a typedef
inline Pair load_pair(const double* from) {
  Pair pair;
  std::memcpy(&pair, from, sizeof pair);
  return pair;
}
inline void store_pair(const Pair& pair, double* to) { std::memcpy(to, &pair, sizeof pair); }
inline Lanes join(const Pair& a, const Pair& b) { return Lanes(__builtin_shufflevector(a, b, 0, 1, 2, 3)); }

/// Four numbers, `stride` apart.
inline Lanes load(const double* from, std::ptrdiff_t stride) {
  return join(Pair{from[0], from[stride]}, Pair{from[2 * stride], from[3 * stride]});
}

/// Four vectors.
template <int Dim>
using LaneVector = Eigen::Matrix<Lanes, Dim, 1>;

/// The vectors of four nodes, whose numbers are `stride` apart; two coordinates of a node move at once.
template <int Dim>
LaneVector<Dim> gather(const double* points, const int* nodes, std::ptrdiff_t stride) {
  const double* at[Lanes::kCount];
  for (int lane = 0; lane < Lanes::kCount; ++lane) at[lane] = points + Dim * std::ptrdiff_t{nodes[stride * lane]};
  const Lanes even = join(load_pair(at[0]), load_pair(at[2])), odd = join(load_pair(at[1]), load_pair(at[3]));
  LaneVector<Dim> vectors;
  vectors[0].value = __builtin_shufflevector(even.value, odd.value, 0, 4, 2, 6);
  vectors[1].value = __builtin_shufflevector(even.value, odd.value, 1, 5, 3, 7);
  if constexpr (Dim == 3) vectors[2] = join(Pair{at[0][2], at[1][2]}, Pair{at[2][2], at[3][2]});
  return vectors;
}

/// Four vectors as they lie in memory, each by itself.
template <int Dim>
class LaneColumns {
 public:
  explicit LaneColumns(const LaneVector<Dim>& vectors) {
    const Lanes::Vector even = __builtin_shufflevector(vectors[0].value, vectors[1].value, 0, 4, 2, 6);
    const Lanes::Vector odd = __builtin_shufflevector(vectors[0].value, vectors[1].value, 1, 5, 3, 7);
    first_two_[0] = __builtin_shufflevector(even, even, 0, 1);
    first_two_[1] = __builtin_shufflevector(odd, odd, 0, 1);
    first_two_[2] = __builtin_shufflevector(even, even, 2, 3);
    first_two_[3] = __builtin_shufflevector(odd, odd, 2, 3);
    if constexpr (Dim == 3) third_ = vectors[2];
  }
  void add_to(double* points, int node, int lane) const {
    double* const to = points + Dim * std::ptrdiff_t{node};
    store_pair(load_pair(to) + first_two_[lane], to);
    if constexpr (Dim == 3) to[2] += third_[lane];
  }
  void take_from(double* points, int node, int lane) const {
    double* const to = points + Dim * std::ptrdiff_t{node};
    store_pair(load_pair(to) - first_two_[lane], to);
    if constexpr (Dim == 3) to[2] -= third_[lane];
  }

 private:
  Pair first_two_[Lanes::kCount];
  Lanes third_;
};

/// Where the numbers of edges lie.
struct EdgeNumbers {
  const int* nodes;  // 2 an edge
  const double *stiffness, *damping, *rest_length, *activation;

  EdgeNumbers operator+(int edge) const {
    return {nodes + 2 * std::ptrdiff_t{edge}, stiffness + edge, damping + edge, rest_length + edge, activation + edge};
  }
};
/// Where the numbers of tets lie.
template <int Dim>
struct TetNumbers {
  const int* nodes;  // Dim + 1 a tet
  const double *volume, *stiffness;

  TetNumbers operator+(int tet) const { return {nodes + (Dim + 1) * std::ptrdiff_t{tet}, volume + tet, stiffness + tet}; }
};

/// One pass over the edges and tets of a body. The four that go together are a quarter of all apart: neighbours share nodes,
/// whose sums would have to wait for each other.
template <int Dim>
struct ElasticSweep {
  const BodyOf<Dim>& body;
  const double *x, *v;       // [m], [m/s]; v null: without dashpots
  const double* activation;  // null: dashpots alone
  double* force;             // [N]

  void add_forces() const {
    if (v == nullptr) {
      add_forces_of_edges<true, false>();
    } else if (activation == nullptr) {
      return add_forces_of_edges<false, true>();
    } else {
      add_forces_of_edges<true, true>();
    }
    add_forces_of_tets();
  }

  /// What the quarters leave over goes with edges of no stiffness from a node to itself.
  template <bool kHasSprings, bool kHasDashpots>
  void add_forces_of_edges() const {
    const int count = body.edge_count(), quarter = count / Lanes::kCount, left = count % Lanes::kCount;
    const EdgeNumbers all{body.edges.data(), body.edge_stiffness.data(), body.edge_damping.data(), body.rest_length.data(),
                          kHasSprings ? activation : body.rest_length.data()};
    const double *const places = x, *const velocities = v;
    double* const sum = force;
    for (int e = 0; e < quarter; ++e) add_four<kHasSprings, kHasDashpots>(all + e, quarter, places, velocities, sum);
    if (left == 0) return;
    int nodes[2 * Lanes::kCount] = {};
    double numbers[4][Lanes::kCount] = {};
    const EdgeNumbers last = all + (count - left);
    std::copy_n(last.nodes, 2 * left, nodes);
    std::copy_n(last.stiffness, left, numbers[0]);
    std::copy_n(last.damping, left, numbers[1]);
    std::copy_n(last.rest_length, left, numbers[2]);
    std::copy_n(last.activation, left, numbers[3]);
    add_four<kHasSprings, kHasDashpots>({nodes, numbers[0], numbers[1], numbers[2], numbers[3]}, 1, places, velocities, sum);
  }

  template <bool kHasSprings, bool kHasDashpots>
  static void add_four(const EdgeNumbers& edges, std::ptrdiff_t stride, const double* x, const double* v, double* force) {
    const LaneVector<Dim> span = gather<Dim>(x, edges.nodes + 1, 2 * stride) - gather<Dim>(x, edges.nodes, 2 * stride);
    const Lanes squared = span.dot(span);
    Lanes pull(0.0);  // over the length
    if constexpr (kHasSprings) {
      const Lanes rest = load(edges.activation, stride) * load(edges.rest_length, stride);
      pull = load(edges.stiffness, stride) * (1.0 - rest / sqrt(squared));
    }
    if constexpr (kHasDashpots) {
      const LaneVector<Dim> rate = gather<Dim>(v, edges.nodes + 1, 2 * stride) - gather<Dim>(v, edges.nodes, 2 * stride);
      pull += load(edges.damping, stride) * rate.dot(span) / squared;
    }
    pull.value = squared.value == 0.0 ? Lanes(0.0).value : pull.value;  // no direction
    const LaneColumns<Dim> along(pull * span);
    for (int lane = 0; lane < Lanes::kCount; ++lane) {
      along.add_to(force, edges.nodes[2 * stride * lane], lane);
      along.take_from(force, edges.nodes[2 * stride * lane + 1], lane);
    }
  }

  /// What the quarters leave over goes with copies of one of them, of no stiffness.
  void add_forces_of_tets() const {
    const auto count = static_cast<int>(body.volume_stiffness.size());
    const int quarter = count / Lanes::kCount, left = count % Lanes::kCount;
    const TetNumbers<Dim> all{body.tets.data(), body.rest_volume.data(), body.volume_stiffness.data()};
    const double* const places = x;
    double* const sum = force;
    for (int t = 0; t < quarter; ++t) add_four(all + t, quarter, places, sum);
    if (left == 0) return;
    int nodes[(Dim + 1) * Lanes::kCount];
    double volume[Lanes::kCount], stiffness[Lanes::kCount] = {};
    const TetNumbers<Dim> last = all + (count - left);
    for (int k = 0; k < Lanes::kCount; ++k) {
      const TetNumbers<Dim> from = last + std::min(k, left - 1);
      std::copy_n(from.nodes, Dim + 1, nodes + (Dim + 1) * k);
      volume[k] = *from.volume;
    }
    std::copy_n(last.stiffness, left, stiffness);
    add_four({nodes, volume, stiffness}, 1, places, sum);
  }

  static void add_four(const TetNumbers<Dim>& tets, std::ptrdiff_t stride, const double* x, double* force) {
    constexpr int kCorners = Dim + 1;
    const LaneVector<Dim> first = gather<Dim>(x, tets.nodes, kCorners * stride);
    Eigen::Matrix<Lanes, Dim, Dim> edge, gradient;  // of J, times volume and kSimplexFactor, to the nodes 1..
    for (int k = 0; k < Dim; ++k) edge.col(k) = gather<Dim>(x, tets.nodes + k + 1, kCorners * stride) - first;
    if constexpr (Dim == 3) {
      gradient << edge.col(1).cross(edge.col(2)), edge.col(2).cross(edge.col(0)), edge.col(0).cross(edge.col(1));
    } else {
      gradient << edge(1, 1), -edge(1, 0), -edge(0, 1), edge(0, 0);
    }
    const Lanes scale = 1.0 / (kSimplexFactor<Dim> * load(tets.volume, stride));
    const Lanes jacobian = edge.col(0).dot(gradient.col(0)) * scale;
    const Lanes pressure = load(tets.stiffness, stride) * (1.0 - jacobian) * scale;
    LaneVector<Dim> balance = LaneVector<Dim>::Constant(Lanes(0.0));
    for (int k = 0; k < Dim; ++k) {
      gradient.col(k) *= pressure;
      balance -= gradient.col(k);
      add_to_nodes(gradient.col(k), tets.nodes + k + 1, kCorners * stride, force);
    }
    add_to_nodes(balance, tets.nodes, kCorners * stride, force);
  }

  static void add_to_nodes(const LaneVector<Dim>& forces, const int* nodes, std::ptrdiff_t stride, double* force) {
    const LaneColumns<Dim> columns(forces);
    for (int lane = 0; lane < Lanes::kCount; ++lane) columns.add_to(force, nodes[stride * lane], lane);
  }
};

}  // namespace hydrostat::physics

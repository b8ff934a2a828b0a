#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "physics/elastic_forces.h"
#include "physics/stepper.h"

namespace hydrostat::physics {

//        +----+----+
//       /|   /|   /|    five tets a cell, a regular one in the middle; neighbours are mirrored so that diagonals meet
//      +----+----+ |
//      | +--|-+--|-+
//      |/   |/   |/
//      +----+----+
struct Lattice {
  Eigen::Matrix3Xd nodes;
  Eigen::Matrix4Xi tets;
  Eigen::Matrix2Xi edges;  // lower node first, in lexicographic order
};

/// The cells (i, j, k) of nx x ny x nz for which `keep` holds, of `cell` [m], from the origin along the axes.
inline Lattice make_lattice(
    int nx, int ny, int nz, double cell,
    const std::function<bool(int, int, int)>& keep = [](int, int, int) { return true; }) {
  constexpr int kTets[5][4] = {{0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}, {1, 2, 4, 7}};
  std::map<std::array<int, 3>, int> index_of;
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector4i> tets;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (!keep(i, j, k)) continue;
        const bool mirrored = (i + j + k) % 2 != 0;
        for (const auto& corners : kTets) {
          Eigen::Vector4i tet;
          for (int c = 0; c < 4; ++c) {
            const int corner = mirrored ? corners[c] ^ 1 : corners[c];
            const std::array<int, 3> key{i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)};
            const auto [entry, is_new] = index_of.try_emplace(key, static_cast<int>(places.size()));
            if (is_new) places.emplace_back(cell * key[0], cell * key[1], cell * key[2]);
            tet[c] = entry->second;
          }
          const Eigen::Vector3d &a = places[tet[0]], &b = places[tet[1]], &c = places[tet[2]], &d = places[tet[3]];
          if ((b - a).dot((c - a).cross(d - a)) < 0) std::swap(tet[2], tet[3]);
          tets.push_back(tet);
        }
      }
    }
  }
  std::set<std::pair<int, int>> edges;
  for (const Eigen::Vector4i& tet : tets) {
    for (int a = 0; a < 4; ++a) {
      for (int b = a + 1; b < 4; ++b) edges.insert(std::minmax(tet[a], tet[b]));
    }
  }
  Lattice lattice;
  lattice.nodes.resize(3, static_cast<Eigen::Index>(places.size()));
  lattice.tets.resize(4, static_cast<Eigen::Index>(tets.size()));
  lattice.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t n = 0; n < places.size(); ++n) lattice.nodes.col(static_cast<Eigen::Index>(n)) = places[n];
  for (std::size_t t = 0; t < tets.size(); ++t) lattice.tets.col(static_cast<Eigen::Index>(t)) = tets[t];
  Eigen::Index e = 0;
  for (const auto& [low, high] : edges) lattice.edges.col(e++) << low, high;
  return lattice;
}

inline Body body_of(const Lattice& lattice, const Material& material = {}) {
  return make_body(lattice.nodes, lattice.tets, lattice.edges, Eigen::VectorXd::Ones(lattice.tets.cols()), material);
}

inline Body bar(int nx, int ny, int nz, double cell, const Material& material = {}) {
  return body_of(make_lattice(nx, ny, nz, cell), material);
}

/// A box of 9 x 2 x 3 cells of 0.1 m on four legs of two cells, about 1 m long: some 150 nodes.
inline Body four_legged(const Material& material = {}) {
  const auto keep = [](int i, int j, int k) { return j >= 2 || ((i == 0 || i == 8) && k != 1); };
  return body_of(make_lattice(9, 4, 3, 0.1, keep), material);
}

/// A bar whose cells are bent out of shape and unevenly filled, from a seed.
inline Body random_body(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Lattice lattice = make_lattice(1 + static_cast<int>(seed % 3), 2, 1 + static_cast<int>(seed % 2), 0.1);
  Eigen::Matrix3Xd rest = lattice.nodes;
  for (double& value : rest.reshaped()) value += 0.015 * uniform(random);
  Eigen::VectorXd fill(lattice.tets.cols());
  for (double& value : fill) value = 0.6 + 0.4 * std::abs(uniform(random));
  return make_body(rest, lattice.tets, lattice.edges, fill, {});
}

inline Eigen::Matrix3Xd random_points(std::mt19937& random, Eigen::Index count, double amplitude) {
  std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
  return Eigen::Matrix3Xd::NullaryExpr(3, count, [&] { return uniform(random); });
}

inline Eigen::VectorXd random_activation(std::mt19937& random, const Body& body, double amplitude) {
  std::uniform_real_distribution<double> uniform(1 - amplitude, 1 + amplitude);
  return Eigen::VectorXd::NullaryExpr(body.edge_count(), [&] { return uniform(random); });
}

inline Eigen::Matrix3d random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond turn(normal(random), normal(random), normal(random), normal(random));
  return turn.normalized().toRotationMatrix();
}

/// The scene of a body whose contact points are the given nodes.
inline Scene scene_of(Body body, const std::vector<int>& contact_nodes, const Ground& ground = {}) {
  Scene scene;
  scene.contact_points.nodes.resize(4, static_cast<Eigen::Index>(contact_nodes.size()));
  scene.contact_points.weights.setZero(4, static_cast<Eigen::Index>(contact_nodes.size()));
  for (std::size_t p = 0; p < contact_nodes.size(); ++p) {
    for (int t = 0; t < body.tet_count(); ++t) {
      for (int k = 0; k < 4; ++k) {
        if (body.tets(k, t) != contact_nodes[p]) continue;
        scene.contact_points.nodes.col(static_cast<Eigen::Index>(p)) = body.tets.col(t);
        scene.contact_points.weights.col(static_cast<Eigen::Index>(p)) = Eigen::Vector4d::Unit(k);
      }
    }
  }
  scene.body = std::move(body);
  scene.ground = ground;
  return scene;
}

/// The nodes at the bottom of the rest shape.
inline std::vector<int> soles(const Body& body) {
  const double lowest = body.rest.row(1).minCoeff();
  std::vector<int> nodes;
  for (int i = 0; i < body.node_count(); ++i) {
    if (body.rest(1, i) < lowest + 1e-9) nodes.push_back(i);
  }
  return nodes;
}

/// Contact points on the faces below the body: `points_per_tet` a tet that has a sole face, with random weights, beside its
/// nodes.
inline void add_skin_points(Scene& scene, int points_per_tet, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.05, 1);
  const Body& body = scene.body;
  const double lowest = body.rest.row(1).minCoeff();
  ContactPoints& points = scene.contact_points;
  for (int t = 0; t < body.tet_count(); ++t) {
    Eigen::Vector4d at_sole;
    for (int k = 0; k < 4; ++k) at_sole[k] = body.rest(1, body.tets(k, t)) < lowest + 1e-9 ? 1 : 0;
    if (at_sole.sum() < 3) continue;
    for (int n = 0; n < points_per_tet; ++n) {
      Eigen::Vector4d weights;
      for (int k = 0; k < 4; ++k) weights[k] = at_sole[k] * uniform(random);
      points.nodes.conservativeResize(4, points.count() + 1);
      points.nodes.rightCols<1>() = body.tets.col(t);
      points.weights.conservativeResize(4, points.nodes.cols());
      points.weights.rightCols<1>() = weights / weights.sum();
    }
  }
}

inline Ground slope(double degrees, double friction) {
  const double angle = degrees * 3.14159265358979323846 / 180;
  return {Eigen::Vector3d(-std::sin(angle), std::cos(angle), 0), 0, friction};
}

/// The body laid on the ground with its soles, at rest.
inline State laid_down(const Scene& scene, double gap = 0) {
  const Body& body = scene.body;
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitY(), scene.ground.normal).toRotationMatrix();
  State state{turn * body.rest, Eigen::Matrix3Xd::Zero(3, body.node_count())};
  const double lowest = (scene.ground.normal.transpose() * state.x).minCoeff();
  state.x.colwise() += (scene.ground.offset + gap - lowest) * scene.ground.normal;
  return state;
}

inline double kinetic_energy(const Body& body, const Eigen::Matrix3Xd& v) {
  return 0.5 * v.colwise().squaredNorm().dot(body.mass);
}

/// Elastic, kinetic and in the field of gravity [J].
inline double energy(const Scene& scene, const State& state, const Eigen::VectorXd& activation) {
  return elastic_energy(scene.body, state.x, activation) + kinetic_energy(scene.body, state.v) -
         scene.gravity.dot(state.x * scene.body.mass);
}

}  // namespace hydrostat::physics

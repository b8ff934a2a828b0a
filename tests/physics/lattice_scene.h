#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <type_traits>
#include <vector>

#include "physics/elastic_forces.h"
#include "physics/stepper.h"
#include "tests/sanitizers.h"

namespace hydrostat::physics {

//        +----+----+
//       /|   /|   /|    five tets a cell, a regular one in the middle; neighbours are mirrored so that diagonals meet
//      +----+----+ |
//      | +--|-+--|-+
//      |/   |/   |/
//      +----+----+
template <int Dim = 3>
struct Lattice {
  PointsOf<Dim> nodes;
  Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> tets;
  Eigen::Matrix2Xi edges;  // lower node first, in lexicographic order
};

/// The first Dim of three components.
template <int Dim>
VectorOf<Dim> vec(double x, double y, double z) {
  return Eigen::Vector3d(x, y, z).head<Dim>();
}

/// The cells (i, j, k) of nx x ny x nz for which `keep` holds, of `cell` [m], from the origin along the axes.
/// In 2D the squares (i, j, 0), of two triangles each.
template <int Dim = 3>
Lattice<Dim> make_lattice(
    int nx, int ny, int nz, double cell,
    const std::function<bool(int, int, int)>& keep = [](int, int, int) { return true; }) {
  constexpr int kTets[5][4] = {{0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}, {1, 2, 4, 7}};
  constexpr int kTriangles[2][4] = {{0, 1, 2, 0}, {1, 3, 2, 0}};
  const auto begin = Dim == 3 ? kTets : kTriangles, end = Dim == 3 ? kTets + 5 : kTriangles + 2;
  std::map<std::array<int, 3>, int> index_of;
  std::vector<VectorOf<Dim>> places;
  std::vector<Eigen::Matrix<int, Dim + 1, 1>> tets;
  for (int k = 0; k < (Dim == 3 ? nz : 1); ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (!keep(i, j, k)) continue;
        const bool mirrored = (i + j + k) % 2 != 0;
        for (auto corners = begin; corners != end; ++corners) {
          Eigen::Matrix<int, Dim + 1, 1> tet;
          for (int c = 0; c <= Dim; ++c) {
            const int corner = mirrored ? (*corners)[c] ^ 1 : (*corners)[c];
            const std::array<int, 3> key{i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)};
            const auto [entry, is_new] = index_of.try_emplace(key, static_cast<int>(places.size()));
            if (is_new) places.push_back(vec<Dim>(cell * key[0], cell * key[1], cell * key[2]));
            tet[c] = entry->second;
          }
          BlockOf<Dim> spans;
          for (int c = 0; c < Dim; ++c) spans.col(c) = places[tet[c + 1]] - places[tet[0]];
          if (spans.determinant() < 0) std::swap(tet[Dim - 1], tet[Dim]);
          tets.push_back(tet);
        }
      }
    }
  }
  std::set<std::pair<int, int>> edges;
  for (const auto& tet : tets) {
    for (int a = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b) edges.insert(std::minmax(tet[a], tet[b]));
    }
  }
  Lattice<Dim> lattice;
  lattice.nodes.resize(Dim, static_cast<Eigen::Index>(places.size()));
  lattice.tets.resize(Dim + 1, static_cast<Eigen::Index>(tets.size()));
  lattice.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t n = 0; n < places.size(); ++n) lattice.nodes.col(static_cast<Eigen::Index>(n)) = places[n];
  for (std::size_t t = 0; t < tets.size(); ++t) lattice.tets.col(static_cast<Eigen::Index>(t)) = tets[t];
  Eigen::Index e = 0;
  for (const auto& [low, high] : edges) lattice.edges.col(e++) << low, high;
  return lattice;
}

template <int Dim>
BodyOf<Dim> body_of(const Lattice<Dim>& lattice, const Material& material = {}) {
  return make_body<Dim>(lattice.nodes, lattice.tets, lattice.edges, Eigen::VectorXd::Ones(lattice.tets.cols()), material);
}

template <int Dim = 3>
BodyOf<Dim> bar(int nx, int ny, int nz, double cell, const Material& material = {}) {
  return body_of(make_lattice<Dim>(nx, ny, nz, cell), material);
}

/// A box of 9 x 2 x 3 cells of 0.1 m on four legs of two cells, about 1 m long: some 150 nodes. In 2D on two legs.
template <int Dim = 3>
BodyOf<Dim> four_legged(const Material& material = {}) {
  const auto keep = [](int i, int j, int k) { return j >= 2 || ((i == 0 || i == 8) && k != 1); };
  return body_of(make_lattice<Dim>(9, 4, 3, 0.1, keep), material);
}

/// A bar whose cells are bent out of shape and unevenly filled, from a seed.
template <int Dim = 3>
BodyOf<Dim> random_body(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Lattice<Dim> lattice = make_lattice<Dim>(1 + static_cast<int>(seed % 3), 2, 1 + static_cast<int>(seed % 2), 0.1);
  PointsOf<Dim> rest = lattice.nodes;
  for (double& value : rest.reshaped()) value += 0.015 * uniform(random);
  Eigen::VectorXd fill(lattice.tets.cols());
  for (double& value : fill) value = 0.6 + 0.4 * std::abs(uniform(random));
  return make_body<Dim>(rest, lattice.tets, lattice.edges, fill, {});
}

template <int Dim = 3>
PointsOf<Dim> random_points(std::mt19937& random, Eigen::Index count, double amplitude) {
  std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
  return PointsOf<Dim>::NullaryExpr(Dim, count, [&] { return uniform(random); });
}

template <int Dim>
Eigen::VectorXd random_activation(std::mt19937& random, const BodyOf<Dim>& body, double amplitude) {
  std::uniform_real_distribution<double> uniform(1 - amplitude, 1 + amplitude);
  return Eigen::VectorXd::NullaryExpr(body.edge_count(), [&] { return uniform(random); });
}

template <int Dim = 3>
BlockOf<Dim> random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  if constexpr (Dim == 3) {
    Eigen::Quaterniond turn(normal(random), normal(random), normal(random), normal(random));
    return turn.normalized().toRotationMatrix();
  } else {
    return Eigen::Rotation2Dd(std::atan2(normal(random), normal(random))).toRotationMatrix();
  }
}

template <int Dim>
SpinOf<Dim> random_spin(std::mt19937& random, double amplitude) {
  return random_points<3>(random, 1, amplitude).template bottomRows<SpinOf<Dim>::RowsAtCompileTime>();
}

/// Turning about the centre of mass, which drifts.
template <int Dim>
PointsOf<Dim> rigid_velocity(const BodyOf<Dim>& body, const PointsOf<Dim>& x, const VectorOf<Dim>& drift,
                             const SpinOf<Dim>& rate) {
  const VectorOf<Dim> centre = centre_of_mass(body, x);
  PointsOf<Dim> v(Dim, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) v.col(i) = drift + turning<Dim>(rate, x.col(i) - centre);
  return v;
}

/// The scene of a body whose contact points are the given nodes.
template <int Dim>
SceneOf<Dim> scene_of(BodyOf<Dim> body, const std::vector<int>& contact_nodes, const GroundOf<Dim>& ground = {}) {
  SceneOf<Dim> scene;
  scene.contact_points.nodes.resize(Dim + 1, static_cast<Eigen::Index>(contact_nodes.size()));
  scene.contact_points.weights.setZero(Dim + 1, static_cast<Eigen::Index>(contact_nodes.size()));
  for (std::size_t p = 0; p < contact_nodes.size(); ++p) {
    for (int t = 0; t < body.tet_count(); ++t) {
      for (int k = 0; k <= Dim; ++k) {
        if (body.tets(k, t) != contact_nodes[p]) continue;
        scene.contact_points.nodes.col(static_cast<Eigen::Index>(p)) = body.tets.col(t);
        scene.contact_points.weights.col(static_cast<Eigen::Index>(p)) = Eigen::Matrix<double, Dim + 1, 1>::Unit(k);
      }
    }
  }
  scene.body = std::move(body);
  scene.ground = ground;
  return scene;
}

/// The scene of a body that touches nothing.
template <int Dim>
SceneOf<Dim> in_the_air(BodyOf<Dim> body, bool with_gravity) {
  SceneOf<Dim> scene = scene_of(std::move(body), {});
  scene.has_ground = false;
  if (!with_gravity) scene.gravity.setZero();
  return scene;
}

/// The nodes at the bottom of the rest shape.
template <int Dim>
std::vector<int> soles(const BodyOf<Dim>& body) {
  const double lowest = body.rest.row(1).minCoeff();
  std::vector<int> nodes;
  for (int i = 0; i < body.node_count(); ++i) {
    if (body.rest(1, i) < lowest + 1e-9) nodes.push_back(i);
  }
  return nodes;
}

/// Contact points on the faces below the body: `points_per_tet` a tet that has a sole face, with random weights, beside its
/// nodes.
template <int Dim>
void add_skin_points(SceneOf<Dim>& scene, int points_per_tet, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.05, 1);
  const BodyOf<Dim>& body = scene.body;
  const double lowest = body.rest.row(1).minCoeff();
  ContactPointsOf<Dim>& points = scene.contact_points;
  for (int t = 0; t < body.tet_count(); ++t) {
    Eigen::Matrix<double, Dim + 1, 1> at_sole;
    for (int k = 0; k <= Dim; ++k) at_sole[k] = body.rest(1, body.tets(k, t)) < lowest + 1e-9 ? 1 : 0;
    if (at_sole.sum() < Dim) continue;
    for (int n = 0; n < points_per_tet; ++n) {
      Eigen::Matrix<double, Dim + 1, 1> weights;
      for (int k = 0; k <= Dim; ++k) weights[k] = at_sole[k] * uniform(random);
      points.nodes.conservativeResize(Dim + 1, points.count() + 1);
      points.nodes.template rightCols<1>() = body.tets.col(t);
      points.weights.conservativeResize(Dim + 1, points.nodes.cols());
      points.weights.template rightCols<1>() = weights / weights.sum();
    }
  }
}

template <int Dim = 3>
GroundOf<Dim> slope(double degrees, double friction) {
  const double angle = degrees * 3.14159265358979323846 / 180;
  return {vec<Dim>(-std::sin(angle), std::cos(angle), 0), 0, friction};
}

/// The turn that takes the y axis to `up`.
template <int Dim>
BlockOf<Dim> turn_to(const VectorOf<Dim>& up) {
  if constexpr (Dim == 3) {
    const Eigen::Vector3d axis = Eigen::Vector3d::UnitY().cross(up);  // as long as the angle's sine, of a unit vector
    return Eigen::AngleAxisd(std::atan2(axis.norm(), up.y()), axis.stableNormalized()).toRotationMatrix();
  } else {
    return BlockOf<Dim>{{up.y(), up.x()}, {-up.x(), up.y()}};
  }
}

/// The body laid on the ground with its soles, at rest.
template <int Dim>
StateOf<Dim> laid_down(const SceneOf<Dim>& scene, double gap = 0) {
  const BodyOf<Dim>& body = scene.body;
  StateOf<Dim> state{turn_to<Dim>(scene.ground.normal) * body.rest, PointsOf<Dim>::Zero(Dim, body.node_count())};
  const double lowest = (scene.ground.normal.transpose() * state.x).minCoeff();
  state.x.colwise() += (scene.ground.offset + gap - lowest) * scene.ground.normal;
  return state;
}

template <int Dim>
double kinetic_energy(const BodyOf<Dim>& body, const PointsOf<Dim>& v) {
  return 0.5 * v.colwise().squaredNorm().dot(body.mass);
}

/// Elastic, kinetic and in the field of gravity [J].
template <int Dim>
double energy(const SceneOf<Dim>& scene, const StateOf<Dim>& state, const Eigen::VectorXd& activation) {
  return elastic_energy(scene.body, state.x, activation) + kinetic_energy(scene.body, state.v) -
         scene.gravity.dot(state.x * scene.body.mass);
}

template <int Dim>
double size_of(const BodyOf<Dim>& body) {
  return size_of_volume<Dim>(body.rest_volume.sum());
}

template <int Dim>
Eigen::VectorXd passive(const BodyOf<Dim>& body) {
  return Eigen::VectorXd::Ones(body.edge_count());
}

// Laws of both dimensions are typed tests on one of these.
template <int D>
struct InDimension {
  static constexpr int kDim = D;
};
using BothDimensions = testing::Types<InDimension<2>, InDimension<3>>;
/// For simulations: the sanitizers see the same sources in the plane.
using SimulatedDimensions = std::conditional_t<kSanitized, testing::Types<InDimension<2>>, BothDimensions>;
struct DimensionName {
  template <typename Type>
  static std::string GetName(int) {
    return std::to_string(Type::kDim) + "d";
  }
};

}  // namespace hydrostat::physics

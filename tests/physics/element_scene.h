#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "physics/element_forces.h"
#include "physics/element_stiffness.h"
#include "tests/sanitizers.h"

namespace hydrostat::physics {

enum class Cut {
  kBoxes,  // quads, hexahedra
  kTwoTriangles,
  kFiveTets,  // a regular one in the middle; neighbours are mirrored so that diagonals meet
  kSixTets,   // around the body diagonal
};

template <int Dim>
constexpr std::array<Cut, Dim == 2 ? 2 : 3> cuts() {
  if constexpr (Dim == 2) {
    return {Cut::kBoxes, Cut::kTwoTriangles};
  } else {
    return {Cut::kBoxes, Cut::kFiveTets, Cut::kSixTets};
  }
}

inline std::string name_of(Cut cut) {
  constexpr const char* kNames[] = {"boxes", "two triangles", "five tets", "six tets"};
  return kNames[static_cast<int>(cut)];
}

/// Corners of the parts that a cell is cut into, bit d of a corner's number being its coordinate d.
inline std::vector<std::vector<int>> parts_of(Cut cut, bool is_mirrored, int dim) {
  switch (cut) {
    case Cut::kBoxes: return {dim == 2 ? std::vector<int>{0, 1, 2, 3} : std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7}};
    case Cut::kTwoTriangles: return {{0, 1, 3}, {0, 3, 2}};
    case Cut::kSixTets: return {{0, 1, 3, 7}, {0, 1, 7, 5}, {0, 2, 7, 3}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 7, 6}};
    case Cut::kFiveTets:
      if (is_mirrored) return {{1, 0, 5, 3}, {2, 0, 3, 6}, {4, 0, 6, 5}, {7, 3, 5, 6}, {0, 3, 6, 5}};
      return {{0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}, {1, 2, 4, 7}};
  }
  return {};
}

/// A box of `size` [m] in `cells`, from the origin along the axes, cut into elements.
template <int Dim>
ElementMesh<Dim> element_bar(const Eigen::Matrix<int, Dim, 1>& cells, const Eigen::Matrix<double, Dim, 1>& size, Cut cut,
                             const ElementMaterial& material = {}) {
  ElementMesh<Dim> mesh;
  const auto index_of = [&](const Eigen::Matrix<int, Dim, 1>& place) {
    int index = 0;
    for (int d = Dim - 1; d >= 0; --d) index = index * (cells[d] + 1) + place[d];
    return index;
  };
  const auto place_of = [](int index, const Eigen::Matrix<int, Dim, 1>& counts) {
    Eigen::Matrix<int, Dim, 1> place;
    for (int d = 0; d < Dim; ++d, index /= counts[d - 1]) place[d] = index % counts[d];
    return place;
  };
  const Eigen::Matrix<int, Dim, 1> nodes = cells.array() + 1;
  mesh.rest.resize(Dim, nodes.prod());
  for (int n = 0; n < nodes.prod(); ++n) {
    mesh.rest.col(n) = place_of(n, nodes).template cast<double>().cwiseQuotient(cells.template cast<double>()).cwiseProduct(size);
  }
  std::vector<std::vector<int>> elements;
  for (int c = 0; c < cells.prod(); ++c) {
    const Eigen::Matrix<int, Dim, 1> cell = place_of(c, cells);
    for (const std::vector<int>& part : parts_of(cut, cell.sum() % 2 != 0, Dim)) {
      std::vector<int> element;
      for (const int corner : part) {
        Eigen::Matrix<int, Dim, 1> place = cell;
        for (int d = 0; d < Dim; ++d) place[d] += corner >> d & 1;
        element.push_back(index_of(place));
      }
      elements.push_back(element);
    }
  }
  mesh.nodes.resize(static_cast<Eigen::Index>(elements[0].size()), static_cast<Eigen::Index>(elements.size()));
  for (Eigen::Index e = 0; e < mesh.nodes.cols(); ++e) {
    mesh.nodes.col(e) = Eigen::Map<Eigen::VectorXi>(elements[static_cast<std::size_t>(e)].data(), mesh.nodes.rows());
    if (cut == Cut::kBoxes) continue;
    Eigen::Matrix<double, Dim, Dim> span;
    for (int d = 0; d < Dim; ++d) span.col(d) = mesh.rest.col(mesh.nodes(d + 1, e)) - mesh.rest.col(mesh.nodes(0, e));
    if (span.determinant() < 0) std::swap(mesh.nodes(Dim - 1, e), mesh.nodes(Dim, e));
  }
  mesh.materials = {material};
  mesh.fill = Eigen::VectorXd::Ones(mesh.nodes.cols());
  return mesh;
}

template <int Dim>
NodeMatrix<Dim> random_nodes(std::mt19937& random, Eigen::Index count, double amplitude) {
  std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
  return NodeMatrix<Dim>::NullaryExpr(Dim, count, [&] { return uniform(random); });
}

template <int Dim>
Gradient<Dim> random_turn(std::mt19937& random) {
  std::normal_distribution<double> normal;
  if constexpr (Dim == 2) {
    return Eigen::Rotation2Dd(3 * normal(random)).toRotationMatrix();
  } else {
    Eigen::Quaterniond turn(normal(random), normal(random), normal(random), normal(random));
    return turn.normalized().toRotationMatrix();
  }
}

/// A bar of some cells about 0.1 m wide, bent out of shape, of uneven materials and fill.
template <int Dim>
ElementMesh<Dim> random_element_mesh(unsigned seed, Cut cut) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Eigen::Matrix<int, Dim, 1> cells = Eigen::Matrix<int, Dim, 1>::Constant(1 + static_cast<int>(seed % 2));
  cells[0] = 1 + static_cast<int>(seed % 3);
  ElementMesh<Dim> mesh = element_bar<Dim>(cells, 0.1 * cells.template cast<double>(), cut);
  mesh.rest += random_nodes<Dim>(random, mesh.rest.cols(), 0.015);
  mesh.materials.clear();
  for (Eigen::Index e = 0; e < mesh.nodes.cols(); ++e) {
    mesh.materials.push_back({800 + 400 * uniform(random), 1e5 * (1 + uniform(random)), 0.49 * uniform(random)});
    mesh.fill[e] = 0.3 + 0.7 * uniform(random);
  }
  return mesh;
}

/// Runs `law(mesh, block, random)` for bodies of every cut and elastic law, over seeds.
template <int Dim, class Law>
void for_random_blocks(unsigned seeds, const Law& check) {
  for (const Cut cut : cuts<Dim>()) {
    for (const ElasticLaw law : {ElasticLaw::kStableNeoHookean, ElasticLaw::kCorotatedLinear}) {
      for (unsigned seed = 0; seed < seeds; ++seed) {
        SCOPED_TRACE(std::to_string(Dim) + "D " + name_of(cut) + ", " + name_of(law) + ", seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const ElementMesh<Dim> mesh = random_element_mesh<Dim>(seed, cut);
        ASSERT_EQ(broken_rule(mesh), "");
        check(mesh, make_element_block(mesh, law), random);
      }
    }
  }
}

template <int Dim>
NodeMatrix<Dim> forces_of(const ElementBlock<Dim>& block, const NodeMatrix<Dim>& x, const ActiveStrain<Dim>* active = nullptr) {
  NodeMatrix<Dim> force = NodeMatrix<Dim>::Zero(Dim, x.cols());
  add_element_forces<Dim>(block, x, active, all_batches(block), force);
  return force;
}

template <int Dim>
double energy_of(const ElementBlock<Dim>& block, const NodeMatrix<Dim>& x, const ActiveStrain<Dim>* active = nullptr) {
  return element_energy<Dim>(block, x, active, all_batches(block));
}

/// Central differences of `value(x)` with respect to every entry of x.
template <class Matrix, class Value>
Matrix slope_of(Matrix x, double step, const Value& value) {
  Matrix slope = x;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const double here = x.reshaped()[k];
    x.reshaped()[k] = here + step;
    const double ahead = value(x);
    x.reshaped()[k] = here - step;
    slope.reshaped()[k] = (ahead - value(x)) / (2 * step);
    x.reshaped()[k] = here;
  }
  return slope;
}

}  // namespace hydrostat::physics

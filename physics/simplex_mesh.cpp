#include "physics/simplex_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <vector>

namespace hydrostat::physics {
namespace {

template <int Dim>
using Index = Eigen::Matrix<int, Dim, 1>;
template <int Dim>
using Simplex = Eigen::Matrix<int, Dim + 1, 1>;

template <int Dim>
double volume_of(const PointsOf<Dim>& nodes, const Simplex<Dim>& simplex) {
  BlockOf<Dim> spans;
  for (int k = 0; k < Dim; ++k) spans.col(k) = nodes.col(simplex[k + 1]) - nodes.col(simplex[0]);
  return spans.determinant() / kSimplexFactor<Dim>;
}

/// Numbers things by their keys, in the order in which they come.
template <typename Key>
class Numbering {
 public:
  int operator()(const Key& key) { return numbers_.try_emplace(key, static_cast<int>(numbers_.size())).first->second; }
  const std::map<Key, int>& numbers() const { return numbers_; }

 private:
  std::map<Key, int> numbers_;
};

template <int Dim>
std::array<int, Dim> key_of(const Index<Dim>& place) {
  std::array<int, Dim> key;
  for (std::size_t d = 0; d < Dim; ++d) key[d] = place[static_cast<Eigen::Index>(d)];
  return key;
}

template <int Dim>
SimplexMeshOf<Dim> with_positive_volumes(PointsOf<Dim> nodes, const std::vector<Simplex<Dim>>& simplices) {
  SimplexMeshOf<Dim> mesh{std::move(nodes), {}};
  mesh.simplices.resize(Dim + 1, static_cast<Eigen::Index>(simplices.size()));
  for (std::size_t t = 0; t < simplices.size(); ++t) {
    Simplex<Dim> simplex = simplices[t];
    if (volume_of<Dim>(mesh.nodes, simplex) < 0) std::swap(simplex[Dim - 1], simplex[Dim]);
    mesh.simplices.col(static_cast<Eigen::Index>(t)) = simplex;
  }
  return mesh;
}

/// Calls visit(place) for every cell of a lattice, x fastest.
template <int Dim, typename Visit>
void for_each_cell(const Index<Dim>& cells, const Visit& visit) {
  for (int n = 0; n < cells.prod(); ++n) {
    Index<Dim> place;
    for (int d = 0, rest = n; d < Dim; rest /= cells[d++]) place[d] = rest % cells[d];
    visit(place);
  }
}

/// The simplices of a unit cube that run along its edges from corner 0 to the opposite one: Kuhn's. Bit d of a corner is its
/// coordinate d.
template <int Dim>
std::vector<std::array<int, Dim + 1>> paths_through_cube() {
  std::array<int, Dim> axes;
  std::iota(axes.begin(), axes.end(), 0);
  std::vector<std::array<int, Dim + 1>> paths;
  do {
    std::array<int, Dim + 1> path{};
    for (std::size_t k = 0; k < Dim; ++k) path[k + 1] = path[k] | 1 << axes[k];
    paths.push_back(path);
  } while (std::next_permutation(axes.begin(), axes.end()));
  return paths;
}

/// A lattice of points with `cells` cells, cut into simplices along the diagonals of the cells; `flips(place)` says in bit d
/// whether a cell is mirrored along axis d. That must be a function of the place along d alone, or the cells do not fit.
template <int Dim, typename Flips>
std::vector<Simplex<Dim>> cut_lattice(const Index<Dim>& cells, const Flips& flips,
                                      const std::vector<std::array<int, Dim + 1>>& cuts, PointsOf<Dim>& places) {
  Numbering<std::array<int, Dim>> number;
  std::vector<Simplex<Dim>> simplices;
  for_each_cell<Dim>(cells, [&](const Index<Dim>& cell) {
    const int mirrored = flips(cell);
    for (const std::array<int, Dim + 1>& cut : cuts) {
      Simplex<Dim> simplex;
      for (int k = 0; k <= Dim; ++k) {
        const int corner = cut[static_cast<std::size_t>(k)] ^ mirrored;
        Index<Dim> place = cell;
        for (int d = 0; d < Dim; ++d) place[d] += corner >> d & 1;
        simplex[k] = number(key_of<Dim>(place));
      }
      simplices.push_back(simplex);
    }
  });
  places.resize(Dim, static_cast<Eigen::Index>(number.numbers().size()));
  for (const auto& [place, n] : number.numbers()) {
    for (std::size_t d = 0; d < Dim; ++d) places(static_cast<Eigen::Index>(d), n) = place[d];
  }
  return simplices;
}

}  // namespace

template <int Dim>
SimplexMeshOf<Dim> mesh_of_box(const VectorOf<Dim>& size, const Eigen::Matrix<int, Dim, 1>& cells) {
  std::vector<std::array<int, Dim + 1>> cuts;
  if constexpr (Dim == 3) {
    cuts = {{0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}, {1, 2, 4, 7}};
  } else {
    cuts = {{0, 1, 2}, {1, 3, 2}};
  }
  PointsOf<Dim> places;
  // Mirroring along one axis turns all the diagonals, so that any two neighbours fit.
  const auto flips = [](const Index<Dim>& cell) { return cell.sum() % 2; };
  const std::vector<Simplex<Dim>> simplices = cut_lattice<Dim>(cells, flips, cuts, places);
  const VectorOf<Dim> step = size.cwiseQuotient(cells.template cast<double>());
  return with_positive_volumes<Dim>((step.asDiagonal() * places).colwise() - size / 2, simplices);
}

template <int Dim>
BoxMeshOf<Dim> lattice_of_box(const VectorOf<Dim>& size, const Eigen::Matrix<int, Dim, 1>& cells) {
  const VectorOf<Dim> step = size.cwiseQuotient(cells.template cast<double>());
  const auto number = [&](const Index<Dim>& place) {
    int n = 0;
    for (int d = Dim - 1; d >= 0; --d) n = n * (cells[d] + 1) + place[d];
    return n;
  };
  BoxMeshOf<Dim> mesh;
  mesh.nodes.resize(Dim, (cells.array() + 1).prod());
  mesh.boxes.resize(1 << Dim, cells.prod());
  for_each_cell<Dim>(cells.array() + 1, [&](const Index<Dim>& place) {
    mesh.nodes.col(number(place)) = step.cwiseProduct(place.template cast<double>()) - size / 2;
  });
  int c = 0;
  for_each_cell<Dim>(cells, [&](const Index<Dim>& cell) {
    for (int corner = 0; corner < 1 << Dim; ++corner) {
      Index<Dim> place = cell;
      for (int d = 0; d < Dim; ++d) place[d] += corner >> d & 1;
      mesh.boxes(corner, c) = number(place);
    }
    ++c;
  });
  return mesh;
}

template <int Dim>
SimplexMeshOf<Dim> mesh_of_ball(double diameter, int cells) {
  PointsOf<Dim> places;
  // The diagonals run outward, so that no simplex has all of its corners on the surface.
  const auto flips = [cells](const Index<Dim>& cell) {
    int mirrored = 0;
    for (int d = 0; d < Dim; ++d) mirrored |= (2 * cell[d] + 1 < cells ? 1 : 0) << d;
    return mirrored;
  };
  const std::vector<Simplex<Dim>> simplices =
      cut_lattice<Dim>(Index<Dim>::Constant(cells), flips, paths_through_cube<Dim>(), places);
  // Cubes around the centre become spheres.
  PointsOf<Dim> nodes = (2.0 / cells * places).array() - 1;
  for (Eigen::Index n = 0; n < nodes.cols(); ++n) {
    const double length = nodes.col(n).norm();
    if (length > 0) nodes.col(n) *= nodes.col(n).template lpNorm<Eigen::Infinity>() / length;
  }
  SimplexMeshOf<Dim> mesh = with_positive_volumes<Dim>(std::move(nodes), simplices);
  const double unit_ball = Dim == 3 ? 4 * M_PI / 3 : M_PI;
  mesh.nodes *= diameter / 2 * std::pow(unit_ball / volume(mesh), 1.0 / Dim);
  return mesh;
}

template <int Dim>
SimplexMeshOf<Dim> refined(const SimplexMeshOf<Dim>& mesh, int parts) {
  // A node is known by the corners of its simplex that count in it, and how much.
  Numbering<std::vector<std::pair<int, int>>> number;
  std::vector<Simplex<Dim>> simplices;
  const std::vector<std::array<int, Dim + 1>> paths = paths_through_cube<Dim>();
  for (Eigen::Index t = 0; t < mesh.simplices.cols(); ++t) {
    Simplex<Dim> corners = mesh.simplices.col(t);
    std::sort(corners.begin(), corners.end());  // neighbours see the same order
    const auto node_at = [&](const Index<Dim>& steps) {
      std::vector<std::pair<int, int>> key;
      for (int k = 0, before = parts; k <= Dim; ++k) {
        const int here = k < Dim ? steps[k] : 0;
        if (before != here) key.emplace_back(corners[k], before - here);
        before = here;
      }
      return number(key);
    };
    for_each_cell<Dim>(Index<Dim>::Constant(parts), [&](const Index<Dim>& cell) {
      for (const std::array<int, Dim + 1>& path : paths) {
        Simplex<Dim> simplex;
        bool is_inside = true;
        for (int k = 0; k <= Dim && is_inside; ++k) {
          Index<Dim> steps = cell;
          for (int d = 0; d < Dim; ++d) steps[d] += path[static_cast<std::size_t>(k)] >> d & 1;
          for (int d = 1; d < Dim; ++d) is_inside = is_inside && steps[d] <= steps[d - 1];
          if (is_inside) simplex[k] = node_at(steps);
        }
        if (is_inside) simplices.push_back(simplex);
      }
    });
  }
  PointsOf<Dim> nodes = PointsOf<Dim>::Zero(Dim, static_cast<Eigen::Index>(number.numbers().size()));
  for (const auto& [key, n] : number.numbers()) {
    for (const auto& [corner, count] : key) nodes.col(n) += static_cast<double>(count) / parts * mesh.nodes.col(corner);
  }
  return with_positive_volumes<Dim>(std::move(nodes), simplices);
}

template <int Dim>
SimplexMeshOf<Dim> mesh_of_regular_simplex(double size, int parts) {
  PointsOf<Dim> corners(Dim, Dim + 1);
  if constexpr (Dim == 3) {
    corners << 0.5, -0.5, 0, 0,  //
        0, 0, 0, std::sqrt(2.0 / 3),  //
        std::sqrt(1.0 / 12), std::sqrt(1.0 / 12), -std::sqrt(1.0 / 3), 0;
  } else {
    corners << -0.5, 0.5, 0,  //
        0, 0, std::sqrt(0.75);
  }
  corners.colwise() -= VectorOf<Dim>(corners.rowwise().mean());
  const Simplex<Dim> all = Simplex<Dim>::LinSpaced(0, Dim);
  return refined(with_positive_volumes<Dim>(size * corners, {all}), parts);
}

template <int Dim>
SimplexMeshOf<Dim> mesh_of_pyramid(const VectorOf<Dim>& size, int parts) {
  // The middle of the base, the apex, the corners of the base in their order around.
  PointsOf<Dim> corners;
  std::vector<Simplex<Dim>> simplices;
  if constexpr (Dim == 3) {
    corners.resize(3, 6);
    corners << 0, 0, -1, 1, 1, -1,  //
        -1, 1, -1, -1, -1, -1,      //
        0, 0, -1, -1, 1, 1;
    for (int k = 0; k < 4; ++k) simplices.push_back({0, 1, 2 + k, 2 + (k + 1) % 4});
  } else {
    corners.resize(2, 4);
    corners << 0, 0, -1, 1,  //
        -1, 1, -1, -1;
    for (int k = 0; k < 2; ++k) simplices.push_back({0, 1, 2 + k});
  }
  return refined(with_positive_volumes<Dim>(0.5 * size.asDiagonal() * corners, simplices), parts);
}

template <int Dim>
double volume(const SimplexMeshOf<Dim>& mesh) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.simplices.cols(); ++t) sum += volume_of<Dim>(mesh.nodes, mesh.simplices.col(t));
  return sum;
}

template <int Dim>
Eigen::Matrix2Xi edges_of(const SimplexMeshOf<Dim>& mesh) {
  std::set<std::pair<int, int>> edges;
  for (Eigen::Index t = 0; t < mesh.simplices.cols(); ++t) {
    for (int a = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b) edges.insert(std::minmax(mesh.simplices(a, t), mesh.simplices(b, t)));
    }
  }
  Eigen::Matrix2Xi result(2, static_cast<Eigen::Index>(edges.size()));
  Eigen::Index e = 0;
  for (const auto& [low, high] : edges) result.col(e++) << low, high;
  return result;
}

template <int Dim>
Eigen::VectorXd shape_qualities(const SimplexMeshOf<Dim>& mesh) {
  const double regular = Dim == 3 ? std::sqrt(1.0 / 72) : std::sqrt(3.0 / 16);  // volume at edge length 1
  Eigen::VectorXd quality(mesh.simplices.cols());
  for (Eigen::Index t = 0; t < quality.size(); ++t) {
    double squared = 0;
    for (int a = 0; a <= Dim; ++a) {
      for (int b = a + 1; b <= Dim; ++b) {
        squared += (mesh.nodes.col(mesh.simplices(a, t)) - mesh.nodes.col(mesh.simplices(b, t))).squaredNorm();
      }
    }
    quality[t] = volume_of<Dim>(mesh.nodes, mesh.simplices.col(t)) / (regular * std::pow(squared / kEdgesPerTet<Dim>, Dim / 2.0));
  }
  return quality;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                     \
  template SimplexMeshOf<Dim> mesh_of_box<Dim>(const VectorOf<Dim>&, const Eigen::Matrix<int, Dim, 1>&);               \
  template BoxMeshOf<Dim> lattice_of_box<Dim>(const VectorOf<Dim>&, const Eigen::Matrix<int, Dim, 1>&);                \
  template SimplexMeshOf<Dim> mesh_of_ball<Dim>(double, int);                                                          \
  template SimplexMeshOf<Dim> refined<Dim>(const SimplexMeshOf<Dim>&, int);                                            \
  template SimplexMeshOf<Dim> mesh_of_regular_simplex<Dim>(double, int);                                               \
  template SimplexMeshOf<Dim> mesh_of_pyramid<Dim>(const VectorOf<Dim>&, int);                                         \
  template double volume<Dim>(const SimplexMeshOf<Dim>&);                                                              \
  template Eigen::Matrix2Xi edges_of<Dim>(const SimplexMeshOf<Dim>&);                                                  \
  template Eigen::VectorXd shape_qualities<Dim>(const SimplexMeshOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics

#include "io/scene_shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "io/surface_mesh.h"
#include "io/svg_text.h"

namespace hydrostat::io {
namespace {

using physics::BlockOf;
using physics::ClosedMeshOf;
using physics::PointsOf;
using physics::SimplexMeshOf;
using physics::VectorOf;

constexpr double kLeastQuality = 5e-3;  // of a simplex [-]: flatter ones are slivers
constexpr double kToldLoss = 0.01, kLargestLoss = 0.15;  // of the volume, by cells that are too large for the surface
constexpr double kRoundOff = 1e-9;  // [m] of places that are told
constexpr long kFewestNodes = 4, kMostNodes = 50000;

template <int Dim>
constexpr long kUsualNodes = Dim == 3 ? 200 : 80;

const std::string kSmallerCells = "Give more 'nodes' or a smaller 'cell_size_m'.";

/// How finely a body is to be meshed: by the length of a cell, or by a number of nodes.
struct Fineness {
  double cell = 0;  // [m], 0: by nodes
  long nodes = 0;

  /// The number of cells along `length` [m] where n of them make nodes_of(n) nodes.
  template <typename NodesOf>
  int parts(double length, const NodesOf& nodes_of) const {
    if (cell > 0) return std::max(1, static_cast<int>(std::lround(length / cell)));
    int n = 1;
    while (nodes_of(n + 1) <= static_cast<double>(nodes)) ++n;
    return n;
  }
};

template <int Dim>
Fineness fineness_of(const TomlReader& body) {
  Fineness fineness;
  if (body.has("cell_size_m") && body.has("nodes")) {
    throw body.refusal("nodes", "'cell_size_m' and 'nodes' both say how fine the mesh is", "Leave one of them out.");
  }
  fineness.cell = body.number_or("cell_size_m", 0, kLength);
  fineness.nodes = body.whole_or("nodes", kUsualNodes<Dim>, kFewestNodes, kMostNodes);
  return fineness;
}

void refuse_too_many(const TomlReader& body, double nodes) {
  if (nodes <= static_cast<double>(kMostNodes)) return;
  throw body.refusal(body.has("cell_size_m") ? "cell_size_m" : "shape", "so small cells make more than " + std::to_string(kMostNodes) + " nodes", "Give a larger 'cell_size_m'.");
}

/// How many cells a box has along each axis.
template <int Dim>
Eigen::Matrix<int, Dim, 1> cells_of_box(const TomlReader& body, const VectorOf<Dim>& size) {
  const Fineness fineness = fineness_of<Dim>(body);
  const auto cells_at = [&](double cell) -> Eigen::Matrix<int, Dim, 1> {
    return (size / cell).array().round().max(1).min(1e5).template cast<int>();
  };
  const auto nodes_at = [&](double cell) { return (cells_at(cell).array() + 1).template cast<double>().prod(); };
  double cell = fineness.cell;
  if (cell == 0) {  // the largest that gives the nodes asked for
    cell = size.maxCoeff();
    while (nodes_at(cell) < 0.9 * static_cast<double>(fineness.nodes)) cell *= 0.99;
  }
  refuse_too_many(body, nodes_at(cell));
  return cells_at(cell);
}

template <int Dim>
SimplexMeshOf<Dim> ball(const TomlReader& body) {
  const double diameter = body.number("size_m", kLength);
  const auto nodes_of = [](int n) { return std::pow(n + 1, Dim); };
  const int cells = std::max(2, fineness_of<Dim>(body).parts(diameter, nodes_of));
  refuse_too_many(body, nodes_of(cells));
  return physics::mesh_of_ball<Dim>(diameter, cells);
}

template <int Dim>
SimplexMeshOf<Dim> regular_simplex(const TomlReader& body) {
  const double size = body.number("size_m", kLength);
  const auto nodes_of = [](double n) { return Dim == 3 ? (n + 1) * (n + 2) * (n + 3) / 6 : (n + 1) * (n + 2) / 2; };
  const int parts = fineness_of<Dim>(body).parts(size, nodes_of);
  refuse_too_many(body, nodes_of(parts));
  return physics::mesh_of_regular_simplex<Dim>(size, parts);
}

template <int Dim>
SimplexMeshOf<Dim> pyramid(const TomlReader& body, const VectorOf<Dim>& size) {
  const auto nodes_of = [](double n) { return Dim == 3 ? (n + 1) * (2 * n * n + 4 * n + 3) / 3 : (n + 1) * (n + 1); };
  // A side of the base has twice as many edges in 2D, where it is cut in the middle, and as many in 3D.
  const int parts = fineness_of<Dim>(body).parts(size.maxCoeff(), nodes_of);
  refuse_too_many(body, nodes_of(parts));
  return physics::mesh_of_pyramid<Dim>(size, parts);
}

template <int Dim>
double enclosed_volume(const ClosedMeshOf<Dim>& surface) {
  double sum = 0;
  for (Eigen::Index f = 0; f < surface.faces().cols(); ++f) {
    BlockOf<Dim> corners;
    for (int k = 0; k < Dim; ++k) corners.col(k) = surface.vertices().col(surface.faces()(k, f));
    sum += corners.determinant() / physics::kSimplexFactor<Dim>;
  }
  return sum;
}

/// The lattice body inside a surface, stretched a little so that it has the surface's volume.
template <int Dim>
SimplexMeshOf<Dim> inside(const TomlReader& body, std::vector<std::string>& warnings) {
  const ClosedMeshOf<Dim> surface = surface_of<Dim>(body, warnings);
  const Fineness fineness = fineness_of<Dim>(body);
  const double whole = enclosed_volume(surface);
  const double cell = fineness.cell > 0 ? fineness.cell : std::pow(whole / static_cast<double>(fineness.nodes), 1.0 / Dim);
  refuse_too_many(body, (((surface.high() - surface.low()) / cell).array() + 3).prod());
  SimplexMeshOf<Dim> mesh = physics::mesh_inside<Dim>(surface, cell);
  const double loss = mesh.simplices.cols() > 0 ? 1 - physics::volume(mesh) / whole : 1;
  if (std::abs(loss) > kLargestLoss) {
    throw body.refusal("shape", "cells of " + std::to_string(cell) + " m lose " + std::to_string(std::lround(100 * loss)) + " % of the volume",
                       kSmallerCells);
  }
  if (std::abs(loss) > kToldLoss) {
    warnings.push_back("The cells cut off " + std::to_string(std::lround(1000 * loss) / 10.0).substr(0, 4) +
                       " % of the body's volume, mostly at its edges; it is stretched about its middle to have it again.");
  }
  const VectorOf<Dim> middle = mesh.nodes.rowwise().mean();
  mesh.nodes = ((mesh.nodes.colwise() - middle) * std::pow(1 - loss, -1.0 / Dim)).colwise() + middle;
  return mesh;
}

template <int Dim>
int count_pieces(const SimplexMeshOf<Dim>& mesh) {
  std::vector<int> parent(static_cast<std::size_t>(mesh.nodes.cols()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root_of = [&](int node) {
    while (parent[static_cast<std::size_t>(node)] != node) node = parent[static_cast<std::size_t>(node)];
    return node;
  };
  for (Eigen::Index t = 0; t < mesh.simplices.cols(); ++t) {
    for (int k = 1; k <= Dim; ++k) parent[static_cast<std::size_t>(root_of(mesh.simplices(k, t)))] = root_of(mesh.simplices(0, t));
  }
  int pieces = 0;
  for (std::size_t n = 0; n < parent.size(); ++n) pieces += parent[n] == static_cast<int>(n) ? 1 : 0;
  return pieces;
}

/// The boxes of a lattice, a step [m] apart, by the nodes of a mesh that stand where the lattice's do.
template <int Dim>
Eigen::MatrixXi cells_of_cut(const physics::BoxMeshOf<Dim>& lattice, const SimplexMeshOf<Dim>& mesh, const VectorOf<Dim>& step) {
  const auto place_of = [&](const VectorOf<Dim>& x) {
    std::array<long, Dim> place;
    for (int d = 0; d < Dim; ++d) place[static_cast<std::size_t>(d)] = std::lround((x[d] - lattice.nodes(d, 0)) / step[d]);
    return place;
  };
  std::map<std::array<long, Dim>, int> node_at;
  for (int n = 0; n < mesh.nodes.cols(); ++n) node_at[place_of(mesh.nodes.col(n))] = n;
  return lattice.boxes.unaryExpr([&](int node) { return node_at.at(place_of(lattice.nodes.col(node))); });
}

double turned_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return physics::cross<2>(b - a, c - a)[0];
}

bool lies_on(const Eigen::Vector2d& point, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return turned_area(a, b, point) == 0 && (point - a).dot(point - b) <= 0;
}

/// Whether two sides of an outline cross each other or touch.
bool cuts_itself(const Eigen::Matrix2Xd& corners) {
  const Eigen::Index count = corners.cols();
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = i + 2; j < count; ++j) {
      if ((j + 1) % count == i) continue;
      const Eigen::Vector2d a = corners.col(i), b = corners.col(i + 1), c = corners.col(j), d = corners.col((j + 1) % count);
      if (turned_area(a, b, c) * turned_area(a, b, d) < 0 && turned_area(c, d, a) * turned_area(c, d, b) < 0) return true;
      if (lies_on(c, a, b) || lies_on(d, a, b) || lies_on(a, c, d) || lies_on(b, c, d)) return true;
    }
  }
  return false;
}

/// `vertices_m` and `triangles`, as a creature's own scene has them.
ClosedMeshOf<3> told_surface(const TomlReader& table) {
  const Eigen::Matrix3Xd vertices = table.lists("vertices_m", 3, kPlace);
  const Eigen::Matrix3Xi triangles =
      table.lists("triangles", 3, {.least = 0, .most = static_cast<double>(vertices.cols() - 1)}).cast<int>();
  const std::string broken = physics::broken_mesh_rule<3>(vertices, triangles);
  if (!broken.empty()) throw table.refusal("triangles", "the surface is not closed: " + broken, "Give a closed surface.");
  return {vertices, triangles};
}

}  // namespace

template <int Dim>
BlockOf<Dim> rotation_of(const TomlReader& table) {
  if constexpr (Dim == 2) {
    return Eigen::Rotation2Dd(radians(table.number_or("rotation_deg", 0))).toRotationMatrix();
  } else {
    const Eigen::Vector3d degrees = table.numbers_or("rotation_deg", Eigen::Vector3d::Zero());
    const auto about = [&](int axis) {
      return Eigen::AngleAxisd(radians(degrees[axis]), Eigen::Vector3d::Unit(axis)).toRotationMatrix();
    };
    return about(2) * about(1) * about(0);
  }
}

template <int Dim>
ClosedMeshOf<Dim> surface_of(const TomlReader& table, std::vector<std::string>& warnings) {
  if constexpr (Dim == 3) {
    if (table.has("vertices_m")) return told_surface(table);
    const std::filesystem::path file = std::filesystem::absolute(table.file()).parent_path() / table.text("file");
    const double scale = table.number_or("scale", 1, kLength);
    try {
      const ClosedMeshOf<3> surface = read_closed_mesh(file, warnings);
      return {scale * surface.vertices(), surface.faces()};
    } catch (const Error& error) {
      throw table.refusal("file", file.string() + ": " + error.what(), error.mend);
    }
  } else {
    Eigen::Matrix2Xd corners = table.lists("outline_m", 2, kPlace);
    if (corners.cols() < 3) throw table.refusal("outline_m", "the outline has fewer than three corners", "Give three or more.");
    for (int k = 0; k < corners.cols(); ++k) {
      if (corners.col(k) != corners.col((k + 1) % corners.cols())) continue;
      throw table.refusal("outline_m", "corner " + std::to_string(k + 1) + " of the outline stands twice", "Give each corner once.");
    }
    if (cuts_itself(corners)) throw table.refusal("outline_m", "the outline cuts itself", "Give the corners in their order around.");
    Eigen::Matrix2Xi sides(2, corners.cols());
    double area = 0;
    for (int k = 0; k < corners.cols(); ++k) {
      sides.col(k) << k, (k + 1) % static_cast<int>(corners.cols());
      area += physics::cross<2>(corners.col(k), corners.col(sides(1, k)))[0];
    }
    if (area < 0) corners = corners.rowwise().reverse().eval();
    const std::string broken = physics::broken_mesh_rule<2>(corners, sides);
    if (!broken.empty()) throw table.refusal("outline_m", "the outline is no closed line: " + broken, "Give each corner once, in their order around.");
    return {corners, sides};
  }
}

template <int Dim>
physics::ElementMesh<Dim> body_mesh(const TomlReader& body, std::string& shape, std::string& element, Eigen::MatrixXi& cells,
                                    std::vector<std::string>& warnings) {
  shape = Dim == 3 ? body.choice("shape", {"cube", "bar", "sphere", "tetrahedron", "pyramid", "mesh"})
                   : body.choice("shape", {"square", "bar", "circle", "triangle", "pyramid", "outline"});
  element = body.choice_or_first("element", Dim == 3 ? std::vector<std::string>{"tet", "hex"} : std::vector<std::string>{"triangle", "quad"});
  const bool of_boxes = element == "hex" || element == "quad";
  const auto size = [&]() -> VectorOf<Dim> { return body.number_or_numbers("size_m", Dim, kLength); };
  SimplexMeshOf<Dim> mesh;
  if (shape == "sphere" || shape == "circle") {
    mesh = ball<Dim>(body);
  } else if (shape == "tetrahedron" || shape == "triangle") {
    mesh = regular_simplex<Dim>(body);
  } else if (shape == "pyramid") {
    mesh = pyramid<Dim>(body, size());
  } else if (shape == "mesh" || shape == "outline") {
    mesh = inside<Dim>(body, warnings);
  } else {
    const VectorOf<Dim> extents = shape == "bar" ? VectorOf<Dim>(body.numbers("size_m", Dim, kLength)) : size();
    const Eigen::Matrix<int, Dim, 1> counts = cells_of_box<Dim>(body, extents);
    const physics::BoxMeshOf<Dim> lattice = physics::lattice_of_box<Dim>(extents, counts);
    if (of_boxes) return {lattice.nodes, lattice.boxes, {}, Eigen::VectorXd::Ones(lattice.boxes.cols())};
    mesh = physics::mesh_of_box<Dim>(extents, counts);
    cells = cells_of_cut<Dim>(lattice, mesh, extents.cwiseQuotient(counts.template cast<double>()));
  }
  if (of_boxes) throw body.refusal("element", "only boxes can be cut into such elements, not a " + shape, "Leave 'element' out.");
  const double quality = physics::shape_qualities(mesh).minCoeff();
  if (!(quality > kLeastQuality)) {
    throw body.refusal("shape", "the mesh has slivers: the flattest element has " + std::to_string(quality) + " of a regular one's volume",
                       kSmallerCells);
  }
  if (const int pieces = count_pieces(mesh); pieces > 1) {
    throw body.refusal("shape", "the mesh falls into " + std::to_string(pieces) + " pieces", kSmallerCells);
  }
  return {mesh.nodes, mesh.simplices, {}, Eigen::VectorXd::Ones(mesh.simplices.cols())};
}

template <int Dim>
std::string extent_in_words(const PointsOf<Dim>& points) {
  const auto list = [](const VectorOf<Dim>& place) {
    std::string text;
    for (const double value : place) text += (text.empty() ? "" : ", ") + short_number(std::abs(value) < kRoundOff ? 0 : value);
    return "[" + text + "]";
  };
  return "from " + list(points.rowwise().minCoeff()) + " to " + list(points.rowwise().maxCoeff());
}

template <int Dim>
std::vector<char> points_within(const TomlReader& table, const PointsOf<Dim>& points) {
  std::vector<char> within(static_cast<std::size_t>(points.cols()), 1);
  if (table.has("box_m") && table.has("normal")) {
    throw table.refusal("normal", "'box_m' and 'normal' both say where", "Leave one of them out.");
  }
  if (table.has("box_m")) {
    const Eigen::MatrixXd corners = table.lists("box_m", Dim);
    if (corners.cols() != 2) throw table.refusal("box_m", "'box_m' has not two corners", "Write it like box_m = [[low ...], [high ...]].");
    for (std::size_t p = 0; p < within.size(); ++p) {
      const VectorOf<Dim> x = points.col(static_cast<Eigen::Index>(p));
      within[p] = (x.array() >= corners.col(0).array()).all() && (x.array() <= corners.col(1).array()).all();
    }
  } else if (table.has("normal")) {
    const VectorOf<Dim> normal = table.numbers("normal", Dim);
    if (normal.norm() == 0) throw table.refusal("normal", "'normal' has no direction", "Give one that is not zero.");
    const double offset = table.number_or("offset_m", 0);
    for (std::size_t p = 0; p < within.size(); ++p) within[p] = normal.normalized().dot(points.col(static_cast<Eigen::Index>(p))) >= offset;
  }
  if (std::count(within.begin(), within.end(), 1) == 0) {
    throw table.refusal(table.has("box_m") ? "box_m" : "normal", "nothing of the body lies there",
                        "Give the place in the body's own frame, unturned: what can be marked lies " + extent_in_words<Dim>(points) + ".");
  }
  return within;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                          \
  template BlockOf<Dim> rotation_of<Dim>(const TomlReader&);                                                \
  template ClosedMeshOf<Dim> surface_of<Dim>(const TomlReader&, std::vector<std::string>&);                 \
  template physics::ElementMesh<Dim> body_mesh<Dim>(const TomlReader&, std::string&, std::string&,          \
                                                    Eigen::MatrixXi&, std::vector<std::string>&);           \
  template std::string extent_in_words<Dim>(const PointsOf<Dim>&);                                          \
  template std::vector<char> points_within<Dim>(const TomlReader&, const PointsOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::io

#include "physics/seam.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace hydrostat::physics {
namespace {

using FaceKey = std::array<int, 4>;  // nodes in ascending order, filled up in front with -1

/// The corners of each face of an element, in an order around it; corners of a face x faces.
template <int Dim>
Eigen::MatrixXi faces_of_element(Eigen::Index nodes_per_element) {
  if (nodes_per_element == Dim + 1) {
    Eigen::MatrixXi faces(Dim, Dim + 1);
    for (int opposite = 0; opposite <= Dim; ++opposite) {
      for (int k = 0, n = 0; k <= Dim; ++k) {
        if (k != opposite) faces(n++, opposite) = k;
      }
    }
    return faces;
  }
  Eigen::MatrixXi faces(1 << (Dim - 1), 2 * Dim);
  for (int axis = 0; axis < Dim; ++axis) {
    const int u = 1 << (axis + 1) % Dim, v = Dim == 3 ? 1 << (axis + 2) % Dim : 0;
    const int around[] = {0, u, u | v, v};
    for (int side = 0; side < 2; ++side) {
      for (int k = 0; k < faces.rows(); ++k) faces(k, 2 * axis + side) = (side << axis) | around[k];
    }
  }
  return faces;
}

/// Where an element's face stands opposite another's.
struct Meeting {
  int element, face;
};
/// Calls back (first, second) for each face that two of the elements share, the first being of the lower number.
template <int Dim, typename Elements, typename Callback>
void for_each_inner_face(const ElementMesh<Dim>& mesh, const Elements& elements, const Callback& callback) {
  const Eigen::MatrixXi local = faces_of_element<Dim>(mesh.nodes.rows());
  std::map<FaceKey, Meeting> first_of;
  for (const int e : elements) {
    for (int f = 0; f < local.cols(); ++f) {
      FaceKey key{-1, -1, -1, -1};
      for (Eigen::Index k = 0; k < local.rows(); ++k) key[static_cast<std::size_t>(3 - k)] = mesh.nodes(local(k, f), e);
      std::sort(key.begin(), key.end());
      const auto [entry, is_new] = first_of.try_emplace(key, Meeting{e, f});
      if (!is_new) callback(entry->second, Meeting{e, f});
    }
  }
}

template <int Dim>
VectorOf<Dim> middle_of(const ElementMesh<Dim>& mesh, int element) {
  return mesh.rest(Eigen::all, mesh.nodes.col(element)).rowwise().mean();
}

/// The face between two elements, as seen from the one behind.
template <int Dim>
SeamFace make_face(const ElementMesh<Dim>& mesh, int seam, int behind, int front, const Eigen::VectorXi& corners) {
  SeamFace face;
  face.seam = seam;
  face.corner_count = static_cast<int>(corners.size());
  face.elements = {behind, front};
  std::array<int, 4> nodes{};
  for (Eigen::Index k = 0; k < corners.size(); ++k) {
    face.corners[0][static_cast<std::size_t>(k)] = corners[k];
    nodes[static_cast<std::size_t>(k)] = mesh.nodes(corners[k], behind);
  }
  const VectorOf<Dim> forward = middle_of(mesh, front) - middle_of(mesh, behind);
  if (area_vector<Dim>(mesh.rest, nodes, face.corner_count).dot(forward) < 0) {
    std::reverse(face.corners[0].begin(), face.corners[0].begin() + face.corner_count);
    std::reverse(nodes.begin(), nodes.begin() + face.corner_count);
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(face.corner_count); ++k) {
    for (int c = 0; c < mesh.nodes.rows(); ++c) {
      if (mesh.nodes(c, front) == nodes[k]) face.corners[1][k] = c;
    }
  }
  return face;
}

/// Whether the elements beside a face have a corner of it that is not one node.
template <int Dim>
bool is_open(const ElementMesh<Dim>& mesh, const SeamFace& face) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(face.corner_count); ++k) {
    if (mesh.nodes(face.corners[0][k], face.elements[0]) != mesh.nodes(face.corners[1][k], face.elements[1])) return true;
  }
  return false;
}

/// The corners of elements at the nodes that a split may double, gathered in groups.
class Corners {
 public:
  /// Corner c of element e at a node.
  struct Corner {
    int node, element, corner, group;
  };

  Corners(const Eigen::MatrixXi& elements, const std::vector<char>& is_marked) {
    for (int e = 0; e < elements.cols(); ++e) {
      for (int c = 0; c < elements.rows(); ++c) {
        if (is_marked[static_cast<std::size_t>(elements(c, e))]) all_.push_back({elements(c, e), e, c, 0});
      }
    }
    std::stable_sort(all_.begin(), all_.end(), [](const Corner& a, const Corner& b) { return a.node < b.node; });
    for (std::size_t k = 0; k < all_.size(); ++k) all_[k].group = static_cast<int>(k);
  }

  std::vector<Corner>& all() { return all_; }

  /// Makes the groups of two elements at a node one; the lower number stays.
  void join(int node, int a, int b) {
    const auto [begin, end] = std::equal_range(all_.begin(), all_.end(), Corner{node, 0, 0, 0},
                                               [](const Corner& one, const Corner& other) { return one.node < other.node; });
    int groups[2] = {-1, -1};
    for (auto corner = begin; corner != end; ++corner) {
      if (corner->element == a) groups[0] = corner->group;
      if (corner->element == b) groups[1] = corner->group;
    }
    const auto [low, high] = std::minmax(groups[0], groups[1]);
    for (auto corner = begin; corner != end; ++corner) {
      if (corner->group == high) corner->group = low;
    }
  }

 private:
  std::vector<Corner> all_;  // by node, then by element
};

/// Joins what hangs together by faces for which `joins` holds.
template <int Dim, typename Joins>
void join_over_faces(const ElementMesh<Dim>& mesh, const std::vector<char>& is_marked, const Joins& joins, Corners& corners) {
  std::vector<int> elements;
  for (const Corners::Corner& corner : corners.all()) elements.push_back(corner.element);
  std::sort(elements.begin(), elements.end());
  elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
  const Eigen::MatrixXi local = faces_of_element<Dim>(mesh.nodes.rows());
  for_each_inner_face(mesh, elements, [&](const Meeting& a, const Meeting& b) {
    if (!joins(a.element, b.element)) return;
    for (const int corner : local.col(a.face)) {
      const int node = mesh.nodes(corner, a.element);
      if (is_marked[static_cast<std::size_t>(node)]) corners.join(node, a.element, b.element);
    }
  });
}

}  // namespace

template <int Dim>
VectorOf<Dim> area_vector(const PointsOf<Dim>& x, const std::array<int, 4>& nodes, int count) {
  if constexpr (Dim == 2) {
    const VectorOf<2> along = x.col(nodes[1]) - x.col(nodes[0]);
    return {along.y(), -along.x()};
  } else {
    const VectorOf<3> a = x.col(nodes[1]) - x.col(nodes[0]), b = x.col(nodes[2]) - x.col(nodes[0]);
    if (count == 3) return 0.5 * a.cross(b);
    return 0.5 * b.cross(VectorOf<3>(x.col(nodes[3]) - x.col(nodes[1])));  // by the diagonals
  }
}

template <int Dim>
std::vector<SeamFace> find_seam_faces(const ElementMesh<Dim>& mesh, const std::vector<SeamOf<Dim>>& seams) {
  std::vector<int> elements(static_cast<std::size_t>(mesh.nodes.cols()));
  std::iota(elements.begin(), elements.end(), 0);
  const Eigen::MatrixXi local = faces_of_element<Dim>(mesh.nodes.rows());
  std::vector<SeamFace> faces;
  for_each_inner_face(mesh, elements, [&](const Meeting& a, const Meeting& b) {
    const Eigen::VectorXi nodes = mesh.nodes(local.col(a.face), a.element);
    const VectorOf<Dim> middle = mesh.rest(Eigen::all, nodes).rowwise().mean();
    for (std::size_t s = 0; s < seams.size(); ++s) {
      const SeamOf<Dim>& seam = seams[s];
      const bool a_is_front = seam.normal.dot(middle_of(mesh, a.element)) >= seam.offset;
      const bool b_is_front = seam.normal.dot(middle_of(mesh, b.element)) >= seam.offset;
      if (a_is_front == b_is_front) continue;
      if ((middle.array() < seam.low.array()).any() || (middle.array() > seam.high.array()).any()) continue;
      const Meeting& behind = a_is_front ? b : a;
      faces.push_back(make_face(mesh, static_cast<int>(s), behind.element, a_is_front ? a.element : b.element,
                                local.col(behind.face)));
      return;
    }
  });
  const SplitMesh<Dim> apart = split_mesh(mesh, faces, std::vector<char>(faces.size(), 1));
  std::erase_if(faces, [&](const SeamFace& face) { return !is_open(apart.mesh, face); });
  return faces;
}

template <int Dim>
SplitMesh<Dim> split_mesh(const ElementMesh<Dim>& mesh, const std::vector<SeamFace>& faces, const std::vector<char>& is_broken) {
  SplitMesh<Dim> split{mesh, Eigen::VectorXi::LinSpaced(mesh.rest.cols(), 0, static_cast<int>(mesh.rest.cols()) - 1)};
  std::vector<char> is_marked(static_cast<std::size_t>(mesh.rest.cols()), 0);
  std::vector<std::array<int, 2>> broken;  // pairs of elements, the lower number first
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (!is_broken[f]) continue;
    const auto [low, high] = std::minmax(faces[f].elements[0], faces[f].elements[1]);
    broken.push_back({low, high});
    for (std::size_t k = 0; k < static_cast<std::size_t>(faces[f].corner_count); ++k) {
      is_marked[static_cast<std::size_t>(mesh.nodes(faces[f].corners[0][k], faces[f].elements[0]))] = 1;
    }
  }
  std::sort(broken.begin(), broken.end());
  Corners whole(mesh.nodes, is_marked), parted = whole;
  join_over_faces(mesh, is_marked, [](int, int) { return true; }, whole);
  join_over_faces(
      mesh, is_marked, [&](int a, int b) { return !std::binary_search(broken.begin(), broken.end(), std::array<int, 2>{a, b}); },
      parted);
  // What met in a node without sharing a face stays with the first of the node.
  for (std::size_t k = 0, first = 0; k < whole.all().size(); ++k) {
    const Corners::Corner& corner = whole.all()[k];
    if (corner.node != whole.all()[first].node) first = k;
    if (corner.group == static_cast<int>(k)) parted.join(corner.node, whole.all()[first].element, corner.element);
  }
  std::map<int, int> node_of;  // group to node; a node's first group is its first corner
  std::vector<int> copies;
  for (std::size_t k = 0, first = 0; k < parted.all().size(); ++k) {
    const Corners::Corner& corner = parted.all()[k];
    if (corner.node != parted.all()[first].node) first = k;
    if (corner.group == static_cast<int>(first)) continue;
    const auto [entry, is_new] =
        node_of.try_emplace(corner.group, static_cast<int>(static_cast<std::size_t>(mesh.rest.cols()) + copies.size()));
    if (is_new) copies.push_back(corner.node);
    split.mesh.nodes(corner.corner, corner.element) = entry->second;
  }
  const Eigen::Index count = mesh.rest.cols(), more = static_cast<Eigen::Index>(copies.size());
  split.origin.conservativeResize(count + more);
  split.origin.tail(more) = Eigen::Map<const Eigen::VectorXi>(copies.data(), more);
  split.mesh.rest = mesh.rest(Eigen::all, split.origin).eval();
  return split;
}

std::vector<int> copies_of(const std::vector<int>& nodes, const Eigen::VectorXi& origin) {
  std::vector<int> copies;
  for (int n = 0; n < origin.size(); ++n) {
    if (std::binary_search(nodes.begin(), nodes.end(), origin[n])) copies.push_back(n);
  }
  return copies;
}

template <int Dim>
BodyOf<Dim> split_body(const FractureOf<Dim>& fracture, const BodyOf<Dim>& whole, const SplitMesh<Dim>& split) {
  BodyOf<Dim> body = fracture.make_body(split.mesh);
  body.rest = whole.rest(Eigen::all, split.origin);
  if (whole.volume_stiffness.size() == 0) body.volume_stiffness.resize(0);
  if (whole.edge_damping.isZero(0)) body.edge_damping.setZero();
  body.held = copies_of(whole.held, split.origin);
  return body;
}

template <int Dim>
Eigen::VectorXi whole_edges(const BodyOf<Dim>& whole, const BodyOf<Dim>& split, const Eigen::VectorXi& origin) {
  std::map<std::pair<int, int>, int> edge_of;
  for (int e = 0; e < whole.edge_count(); ++e) edge_of[{whole.edges(0, e), whole.edges(1, e)}] = e;
  Eigen::VectorXi edges(split.edge_count());
  for (int e = 0; e < split.edge_count(); ++e) {
    const auto [low, high] = std::minmax(origin[split.edges(0, e)], origin[split.edges(1, e)]);
    edges[e] = edge_of.at({low, high});
  }
  return edges;
}

std::vector<int> parts_of_nodes(const Eigen::MatrixXi& elements) {
  std::vector<int> part(static_cast<std::size_t>(elements.size() == 0 ? 0 : elements.maxCoeff() + 1));
  std::iota(part.begin(), part.end(), 0);
  const auto up = [&](int n) -> int& { return part[static_cast<std::size_t>(n)]; };
  const auto root = [&](int n) {
    while (up(n) != n) n = up(n) = up(up(n));
    return n;
  };
  for (const auto& nodes : elements.colwise()) {
    for (const int node : nodes) {
      const auto [low, high] = std::minmax({root(nodes[0]), root(node)});
      up(high) = low;
    }
  }
  for (std::size_t n = 0; n < part.size(); ++n) part[n] = root(static_cast<int>(n));
  return part;
}

int count_parts(const Eigen::MatrixXi& elements) {
  const std::vector<int> part = parts_of_nodes(elements);
  int parts = 0;
  std::vector<char> is_used(part.size(), 0);
  for (const int node : elements.reshaped()) is_used[static_cast<std::size_t>(node)] = 1;
  for (std::size_t n = 0; n < part.size(); ++n) parts += is_used[n] && part[n] == static_cast<int>(n);
  return parts;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                    \
  template VectorOf<Dim> area_vector<Dim>(const PointsOf<Dim>&, const std::array<int, 4>&, int);                      \
  template std::vector<SeamFace> find_seam_faces<Dim>(const ElementMesh<Dim>&, const std::vector<SeamOf<Dim>>&);      \
  template SplitMesh<Dim> split_mesh<Dim>(const ElementMesh<Dim>&, const std::vector<SeamFace>&,                      \
                                          const std::vector<char>&);                                                  \
  template BodyOf<Dim> split_body<Dim>(const FractureOf<Dim>&, const BodyOf<Dim>&, const SplitMesh<Dim>&);            \
  template Eigen::VectorXi whole_edges<Dim>(const BodyOf<Dim>&, const BodyOf<Dim>&, const Eigen::VectorXi&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics

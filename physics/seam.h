#pragma once

#include <array>
#include <functional>
#include <limits>
#include <vector>

#include "physics/contact.h"

namespace hydrostat::physics {

/// A plane along which a body may split, where it is marked: in the body's own frame, as ElementMesh has it.
template <int Dim>
struct SeamOf {
  VectorOf<Dim> normal = VectorOf<Dim>::UnitY();  // of length 1
  double offset = 0;                              // [m] in front is where normal . x >= offset
  VectorOf<Dim> low = VectorOf<Dim>::Constant(-std::numeric_limits<double>::infinity());  // [m] marked in this box alone
  VectorOf<Dim> high = VectorOf<Dim>::Constant(std::numeric_limits<double>::infinity());
  double strength = 1e5;  // [Pa] the tension at which it breaks, > 0
};

/// A face of the mesh between two elements that a seam parts.
struct SeamFace {
  int seam = 0;
  int corner_count = 0;
  std::array<int, 2> elements{};               // behind the seam and in front of it
  std::array<std::array<int, 4>, 2> corners{};  // of each of the two: which of its nodes make the face, in the same order, around
                                               // it such that its area points to the front
};

/// The faces between elements whose middles lie on different sides of a seam: planes snap to the mesh. A face of several seams
/// is the first one's; faces whose breaking parts nothing are left out.
template <int Dim>
std::vector<SeamFace> find_seam_faces(const ElementMesh<Dim>& mesh, const std::vector<SeamOf<Dim>>& seams);

/// A mesh in which nodes of broken faces are doubled.
template <int Dim>
struct SplitMesh {
  ElementMesh<Dim> mesh;
  Eigen::VectorXi origin;  // of each node: which of the whole mesh it is (the first N) or is a copy of (all others)
};
/// A node becomes as many as there are groups of its elements that hang together by faces that are not broken; the group of the
/// first element keeps its number. `is_broken` has an entry a face.
template <int Dim>
SplitMesh<Dim> split_mesh(const ElementMesh<Dim>& mesh, const std::vector<SeamFace>& faces, const std::vector<char>& is_broken);

/// The area vector of a face whose corners stand there, in the order around [m2]; in 2D of a side, one metre deep.
template <int Dim>
VectorOf<Dim> area_vector(const PointsOf<Dim>& x, const std::array<int, 4>& nodes, int count);

/// Which nodes, in ascending order, come of some of another mesh's (in ascending order): `origin` has which each is of.
std::vector<int> copies_of(const std::vector<int>& nodes, const Eigen::VectorXi& origin);

/// A body's seams, and how its parts are made.
template <int Dim>
struct FractureOf {
  std::vector<SeamOf<Dim>> seams;
  ElementMesh<Dim> mesh;  // that the whole body is made of
  std::vector<SeamFace> faces;
  std::function<BodyOf<Dim>(const ElementMesh<Dim>&)> make_body;  // of a mesh, as the whole body was made
  SelfContact self_contact = {};  // of the parts, from the first break on
};

/// The body of a split mesh: placed, held and without effects as the whole one.
template <int Dim>
BodyOf<Dim> split_body(const FractureOf<Dim>& fracture, const BodyOf<Dim>& whole, const SplitMesh<Dim>& split);

/// Of each constraint of a body that was split: which of the whole body it is a part of. `origin` as in SplitMesh.
template <int Dim>
Eigen::VectorXi whole_edges(const BodyOf<Dim>& whole, const BodyOf<Dim>& split, const Eigen::VectorXi& origin);

/// Parts that share no node, which the elements (a column each) make: of each node up to the greatest that an element has, the least node
/// of its part.
std::vector<int> parts_of_nodes(const Eigen::MatrixXi& elements);
/// How many they are.
int count_parts(const Eigen::MatrixXi& elements);

}  // namespace hydrostat::physics

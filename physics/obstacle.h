#pragma once

#include <string>
#include <variant>
#include <vector>

#include "physics/dimension.h"

namespace hydrostat::physics {

/// A closed surface of triangles (segments in 2D), told inside from outside.
/// Sign by the angle-weighted normal of the nearest face, edge or vertex: Baerentzen, Aanaes, "Signed Distance Computation
/// Using the Angle Weighted Pseudonormal", TVCG 2005.
template <int Dim>
class ClosedMeshOf {
 public:
  using Faces = Eigen::Matrix<int, Dim, Eigen::Dynamic>;

  /// vertices [m] Dim x V; faces Dim x F, counter-clockwise seen from outside (2D: with the inside on their left).
  /// They must not break the rule below.
  ClosedMeshOf(PointsOf<Dim> vertices, Faces faces);

  /// Negative inside [m]; `normal` becomes the gradient, a unit vector.
  double signed_distance(const VectorOf<Dim>& point, VectorOf<Dim>& normal) const;
  const PointsOf<Dim>& vertices() const { return vertices_; }
  const Faces& faces() const { return faces_; }
  /// Where the surface is pointed: no neighbour of the vertex lies above its tangent plane.
  const std::vector<int>& convex_vertices() const { return convex_vertices_; }
  const PointsOf<Dim>& vertex_normals() const { return vertex_normals_; }  // unit
  const VectorOf<Dim>& low() const { return boxes_.front().low; }
  const VectorOf<Dim>& high() const { return boxes_.front().high; }

 private:
  struct Box {  // of a binary tree over the faces
    VectorOf<Dim> low, high;
    int left = -1, right = -1;  // boxes; -1 for a leaf
    int begin = 0, end = 0;     // of order_
  };
  struct Nearest {
    double squared_distance;
    VectorOf<Dim> point, normal;  // the normal of the feature
  };
  int grow_tree(int begin, int end);
  void find_normals();
  void consider(int face, const VectorOf<Dim>& point, Nearest& nearest) const;

  PointsOf<Dim> vertices_, face_normals_, vertex_normals_;
  PointsOf<Dim> edge_normals_;  // 3D: column 3 f + k is of face f's edge from corner k; not unit
  Faces faces_;
  std::vector<int> order_, convex_vertices_;
  std::vector<Box> boxes_;
};

/// Says why these vertices and faces are no closed surface; empty when they are one.
template <int Dim>
std::string broken_mesh_rule(const PointsOf<Dim>& vertices, const Eigen::Matrix<int, Dim, Eigen::Dynamic>& faces);

struct HalfSpace {};  // free where y > 0 in its own frame
template <int Dim>
struct BoxOf {
  VectorOf<Dim> half_extents;  // [m]
};
struct Ball {
  double radius;  // [m]
};

/// A thing in the body's way that nothing moves but its own velocity.
template <int Dim>
struct ObstacleOf {
  std::variant<HalfSpace, BoxOf<Dim>, Ball, ClosedMeshOf<Dim>> shape;
  VectorOf<Dim> place = VectorOf<Dim>::Zero();     // [m] of the origin of its own frame
  BlockOf<Dim> turn = BlockOf<Dim>::Identity();    // from its own frame to the world's
  double friction = 0.8;                           // Coulomb's coefficient [-]
  VectorOf<Dim> velocity = VectorOf<Dim>::Zero();  // [m/s] prescribed; its owner may change it between two steps
};

/// From the obstacle, moved on by `travel` [m], to `point` [m], negative inside; `normal` becomes the gradient.
template <int Dim>
double signed_distance(const ObstacleOf<Dim>& obstacle, const VectorOf<Dim>& travel, const VectorOf<Dim>& point,
                       VectorOf<Dim>& normal);

/// No more than signed_distance where that is positive [m], and quickly found.
template <int Dim>
double distance_at_least(const ObstacleOf<Dim>& obstacle, const VectorOf<Dim>& travel, const VectorOf<Dim>& point);

/// What may poke into the middle of a face: a pointed corner, or a whole ball.
template <int Dim>
struct CornersOf {
  PointsOf<Dim> places;   // [m] Dim x C in the world, before any travel
  PointsOf<Dim> normals;  // Dim x C, unit, the middle of what the corner points to; zero for a ball
  double radius = 0;      // [m]
};
template <int Dim>
CornersOf<Dim> corners_of(const ObstacleOf<Dim>& obstacle);

}  // namespace hydrostat::physics

#pragma once

#include <array>
#include <cstddef>

#include "physics/body.h"

namespace hydrostat::physics {

/// Points of the skin where contact is tested: point p is the sum over k of weights(k, p) * x(nodes(k, p)).
template <int Dim>
struct ContactPointsOf {
  Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> nodes;       // Dim + 1 x P
  Eigen::Matrix<double, Dim + 1, Eigen::Dynamic> weights;  // Dim + 1 x P, >= 0, sum 1

  int count() const { return static_cast<int>(nodes.cols()); }
  VectorOf<Dim> of(const ConstPointsOf<Dim>& nodal, int p) const {
    VectorOf<Dim> sum = nodal.col(nodes(0, p)) * weights(0, p);
    for (int k = 1; k <= Dim; ++k) sum += nodal.col(nodes(k, p)) * weights(k, p);
    return sum;
  }
};
using ContactPoints = ContactPointsOf<3>;

/// The half space normal . x >= offset is free.
template <int Dim>
struct GroundOf {
  VectorOf<Dim> normal = VectorOf<Dim>::UnitY();
  double offset = 0;      // [m]
  double friction = 0.8;  // Coulomb's coefficient [-]
};
using Ground = GroundOf<3>;

/// How the body is held against itself.
struct SelfContact {
  bool is_on = false;
  double friction = 0.8;     // Coulomb's coefficient [-]
  double near_at_rest = 0;   // [m] what is as near in the rest shape never touches: a body may be made of cells in one place
  Eigen::VectorXi region;    // of each node (N); empty: all are of one
  Eigen::MatrixX<bool> meet;  // regions x regions, symmetric: which may come to touch; empty: all
};

/// One place of the body that may touch something: the sum over k of weights[k] x(nodes[k]).
/// Against the body itself it is what a place stands apart from another: the nodes of one have positive weights, those of a tet
/// of the other the negative of its barycentric coordinates there, so that the sum is zero and equal and opposite forces act in
/// one point.
template <int Dim>
struct ContactOf {
  static constexpr int kMostNodes = Dim * (Dim + 1);
  static constexpr int kItself = -1;
  int slot;     // of the pair of place and surface, the same in all steps
  int surface;  // 0 is the ground where the scene has one, then the obstacles; kItself
  int feature;  // of the body: a contact point, then the edges and then the faces between them; a place of SelfContactSet
  int node_count, point_count;
  std::array<int, kMostNodes> nodes;
  std::array<double, kMostNodes> weights;
  std::array<int, Dim> points;     // contact points that share what it bears; against itself the edge that it crosses
  std::array<double, Dim> shares;  // sum 1
  double inverse_mass;             // [1/kg] that an impulse meets; 0 where all nodes are held
  VectorOf<Dim> normal;            // away from the surface
  double gap;                      // [m], negative inside; infinite where nothing stands opposite

  bool is_internal() const { return surface == kItself; }
  VectorOf<Dim> of(const PointsOf<Dim>& nodal) const {
    VectorOf<Dim> sum = nodal.col(nodes[0]) * weights[0];
    for (int k = 1; k < node_count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      sum += nodal.col(nodes[n]) * weights[n];
    }
    return sum;
  }
};

}  // namespace hydrostat::physics

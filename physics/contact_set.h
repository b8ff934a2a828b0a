#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "physics/scene.h"

namespace hydrostat::physics {

/// One place of the body that may touch one surface: the sum over k of weights[k] x(nodes[k]).
template <int Dim>
struct ContactOf {
  static constexpr int kMostNodes = Dim * (Dim + 1);
  int slot;     // of the pair of place and surface, the same in all steps
  int surface;  // 0 is the ground where the scene has one, then the obstacles
  int feature;  // of the body: a contact point, then the edges and then the faces between them
  int node_count, point_count;
  std::array<int, kMostNodes> nodes;
  std::array<double, kMostNodes> weights;
  std::array<int, Dim> points;     // contact points that share what it bears
  std::array<double, Dim> shares;  // sum 1
  double inverse_mass;             // [1/kg] that an impulse meets; 0 where all nodes are held
  VectorOf<Dim> normal;            // away from the surface
  double gap;                      // [m], negative inside; infinite where nothing stands opposite

  VectorOf<Dim> of(const PointsOf<Dim>& nodal) const {
    VectorOf<Dim> sum = nodal.col(nodes[0]) * weights[0];
    for (int k = 1; k < node_count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      sum += nodal.col(nodes[n]) * weights[n];
    }
    return sum;
  }
};

/// The impulse [N s] that a place moving at `velocity` [m/s] against its surface needs in all, `impulse` being in its velocity
/// already: none slower than least_velocity along the normal, none along the surface, inside Coulomb's cone.
template <int Dim>
VectorOf<Dim> impulse_in_cone(const ContactOf<Dim>& contact, const VectorOf<Dim>& velocity, double least_velocity,
                              double friction, const VectorOf<Dim>& impulse) {
  const VectorOf<Dim>& normal = contact.normal;
  const double normal_velocity = normal.dot(velocity);
  const double normal_impulse =
      std::max(0.0, normal.dot(impulse) + (least_velocity - normal_velocity) / contact.inverse_mass);
  VectorOf<Dim> tangential =
      impulse - normal.dot(impulse) * normal - (velocity - normal_velocity * normal) / contact.inverse_mass;
  const double limit = friction * normal_impulse, size = tangential.norm();
  if (size > limit) tangential *= limit / size;
  return normal_impulse * normal + tangential;
}

/// Finds where the body may touch ground and obstacles. Contact points are tested against every surface. What has corners
/// or is round is also felt between them: along the edges of the contact faces the deepest place is sought, and corners and
/// balls are held against the faces, so that an obstacle's edge inside one element does not slip through.
/// Without ground, obstacles or contact points it is empty and costs nothing.
template <int Dim>
class ContactSet {
 public:
  explicit ContactSet(const SceneOf<Dim>& scene);

  bool is_empty() const { return slot_count_ == 0; }
  int slot_count() const { return slot_count_; }
  /// Chooses as candidates all that may come to touch while no place moves more than `reach` [m].
  void find(const StateOf<Dim>& state, double reach);
  std::vector<ContactOf<Dim>>& candidates() { return candidates_; }
  const std::vector<ContactOf<Dim>>& candidates() const { return candidates_; }
  /// Brings gap and normal of a candidate, and the place of one between the contact points, to `x`.
  void update(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, ContactOf<Dim>& contact) const;
  /// The gap of a contact whose place on the body stays: `normal` becomes the gradient.
  double gap(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, const ContactOf<Dim>& contact,
             VectorOf<Dim>& normal) const;

  double friction(const ContactOf<Dim>& contact) const;
  /// Of the surface [m/s].
  VectorOf<Dim> velocity(const ContactOf<Dim>& contact) const;
  /// Moves the obstacles that have a velocity on by h [s]. Allocates where `travel` is still empty.
  void move_obstacles(double h, PointsOf<Dim>& travel) const;
  double fastest_obstacle() const;  // [m/s]

 private:
  struct Feature {  // contact points at its ends or corners
    int point_count;
    std::array<int, Dim> points;
  };
  VectorOf<Dim> travel_of(const PointsOf<Dim>& travel, int surface) const;
  double distance(const PointsOf<Dim>& travel, int surface, const VectorOf<Dim>& point, VectorOf<Dim>& normal) const;
  bool is_near(const StateOf<Dim>& state, int surface, const Feature& feature, double reach) const;
  void take_shares(ContactOf<Dim>& contact) const;
  void find_deepest_of_edge(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, ContactOf<Dim>& contact) const;
  void find_deepest_corner(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, ContactOf<Dim>& contact) const;

  const SceneOf<Dim>& scene_;
  int first_obstacle_ = 0;  // 1 where there is ground
  int slot_count_ = 0;
  std::vector<Feature> features_;        // points, edges, faces
  std::vector<int> slot_begin_;          // of each surface
  std::vector<int> feature_count_;       // of each surface
  std::vector<CornersOf<Dim>> corners_;  // of each surface
  Eigen::VectorXd inverse_mass_;         // [1/kg] of the nodes, 0 of held ones
  std::vector<ContactOf<Dim>> candidates_, point_contacts_;
};

}  // namespace hydrostat::physics

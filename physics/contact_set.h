#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "physics/self_contact.h"
#include "physics/way_out.h"

namespace hydrostat::physics {

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
/// What starts deep inside an obstacle is led out as one (WayOut).
/// Where the scene asks for it the body is held against itself (SelfContactSet): its candidates stand behind all others.
/// Without anything to touch, or with it, it is empty and costs nothing.
template <int Dim>
class ContactSet {
 public:
  explicit ContactSet(const SceneOf<Dim>& scene);

  bool is_empty() const { return slot_count() == 0; }
  bool has_internal() const { return !itself_.is_empty(); }
  int slot_count() const { return slot_count_ + itself_.slot_count(); }
  /// Of finding and updating; what is near is pushed elsewhere.
  ContactWork work() const;
  /// Chooses as candidates all that may come to touch while no place moves more than `reach` [m], against the body itself while
  /// none moves more than `own_reach`.
  void find(const StateOf<Dim>& state, double reach, double own_reach);
  void find(const StateOf<Dim>& state, double reach) { find(state, reach, reach); }
  /// To be called when the state may have nothing to do with that of the last find.
  void forget() {
    itself_.forget();
    starts_unknown_ = true;
  }
  std::vector<ContactOf<Dim>>& candidates() { return candidates_; }
  const std::vector<ContactOf<Dim>>& candidates() const { return candidates_; }
  /// Brings gap and normal of a candidate, and the place of one between the contact points, to `x`.
  void update(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, ContactOf<Dim>& contact);
  /// The gap of a contact whose place on the body stays: `normal` becomes the gradient.
  double gap(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, const ContactOf<Dim>& contact,
             VectorOf<Dim>& normal) const;

  /// Moves the place of a contact of the body with itself to where `x` has it; its normal and gap stay.
  void carry(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const { itself_.carry(x, contact); }

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
  /// The same for a contact point, which may be led out another way than the nearest.
  double distance_of_point(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, const ContactOf<Dim>& contact, VectorOf<Dim>& normal) const;
  bool is_led(const ContactOf<Dim>& contact) const;
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
  SelfContactSet<Dim> itself_;
  WayOut<Dim> way_out_;
  bool starts_unknown_ = true;
  ContactWork work_;
};

}  // namespace hydrostat::physics

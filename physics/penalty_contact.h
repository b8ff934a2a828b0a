#pragma once

#include "physics/contact_set.h"
#include "physics/system_matrix.h"

namespace hydrostat::physics {

/// Contact as the minimum of a potential, for implicit methods: a stiff one-sided spring per touching place, and friction a
/// spring to an anchor that is dragged along when it pulls harder than Coulomb's limit, with a lagged normal force.
/// What starts inside an obstacle is lifted out at push_out_speed, for its spring's rest place recedes no faster.
/// Where the body may touch itself, the plane that the surface makes when the step begins is held through the step.
/// Source: Li et al., "Incremental Potential Contact", SIGGRAPH 2020, sections 4 and 5.4, with springs for the barrier.
template <int Dim>
class PenaltyContact {
 public:
  explicit PenaltyContact(const SceneOf<Dim>& scene);

  bool is_needed() const { return !set_.is_empty(); }
  bool has_internal() const { return set_.has_internal(); }
  /// What contact alone has done.
  ContactWork work() const;
  /// To be called when the state is not the one that the last step left behind.
  void forget();
  /// Finds what may touch within `reach` [m] of the start and lays the anchors; `foreseen` is about where the step ends.
  void begin(const StateOf<Dim>& start, const PointsOf<Dim>& foreseen, double dt, double reach);
  /// Takes the friction limits and their directions from `x`.
  void update_friction(const PointsOf<Dim>& x);
  /// Leaves only `part` [-] of the last update of the limits.
  void shorten_friction_update(double part);
  double potential(const PointsOf<Dim>& x);                       // [J]
  void add_forces(const PointsOf<Dim>& x, PointsOf<Dim>& force);  // [N]; keeps them for book
  void add_stiffness(const PointsOf<Dim>& x, double factor, SystemMatrixOf<Dim>& matrix);
  /// Takes from the velocities of touching places what approaches and, inside Coulomb's cone, slides: what book then books
  /// with a dt of 1 are the impulses of that.
  void stop_approach(const PointsOf<Dim>& x, const Eigen::VectorXd& inverse_mass, PointsOf<Dim>& v);
  /// Books the forces of the last add_forces, as acting for dt at the places of `x`.
  void book(double dt, const PointsOf<Dim>& x, ImpulsesOf<Dim>& impulses) const;
  /// Done on the body by what lifts it out of obstacles in which it started [J].
  double lift_work() const;
  /// The step is done: drags the anchors, moves the obstacles.
  void end(const PointsOf<Dim>& x, PointsOf<Dim>& obstacle_travel);

 private:
  struct Touch {
    ContactOf<Dim> contact;
    VectorOf<Dim> anchor, friction_normal, force;
    double limit = 0, last_limit = 0;  // [N] of friction
    double depth_at_rest = 0;          // [m] below the surface where the normal spring ends
    double lift_work = 0;              // [J] that moving it up in this step stores in the spring
    bool stops = false;                // touches at the end of the step
    double plane_offset = 0;           // of a contact between the points: its surface is held to be a plane
    double stiffness = 0;              // [N/m] normal and tangential
    std::array<double, ContactOf<Dim>::kMostNodes> start_weights;  // of a contact with itself that stop_approach has carried on
  };
  double depth(const Touch& touch, const PointsOf<Dim>& x, VectorOf<Dim>& normal) const;
  VectorOf<Dim> slip(const Touch& touch, const PointsOf<Dim>& x) const;
  void lay_anchor(const StateOf<Dim>& start, double dt, Touch& touch) const;

  ContactSet<Dim> set_;
  double stiffness_ = 0, own_stiffness_ = 0;  // [N/m] of a place, against others and against the body itself
  double size_ = 0;                           // [m]
  double push_out_speed_ = 0;
  PointsOf<Dim> travel_;  // [m] of the obstacles at the end of the step
  std::vector<Touch> touches_;
  PointsOf<Dim> stretch_;          // [m] Dim x slots, of the friction springs
  Eigen::VectorXd depth_at_rest_;  // [m] slots
  std::vector<char> touching_;     // slots: at the end of the last step
  ContactWork work_;  // beside the set's
};

}  // namespace hydrostat::physics

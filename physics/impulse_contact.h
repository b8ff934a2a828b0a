#pragma once

#include "physics/contact_set.h"

namespace hydrostat::physics {

/// Contact by impulses on the velocity that moves the body, for methods of short explicit substeps: a place at gap g may
/// approach its surface with g / h at most; projected Gauss-Seidel over the places inside Coulomb's cone.
/// Source: Moreau's time stepping as in Jean, "The non-smooth contact dynamics method", CMAME 1999, section 4.
template <int Dim>
class ImpulseContact {
 public:
  explicit ImpulseContact(const SceneOf<Dim>& scene);

  bool is_needed() const { return !set_.is_empty(); }
  bool has_internal() const { return set_.has_internal(); }
  /// What contact alone has done.
  ContactWork work() const;
  /// To be called when the state is not the one that the last substep left behind.
  void forget_reach() { reach_ = 0; }
  /// To be called when that state may have nothing to do with this one.
  void forget() {
    set_.forget();
    impulse_.setZero();
    given_.setZero();
  }
  /// Adds forces [N] that go on all through this substep, learned from the impulses of the last one, and books them: push_apart
  /// then does and books what these lack or have too much.
  void add_last_forces(double h, const StateOf<Dim>& state, PointsOf<Dim>& force, ImpulsesOf<Dim>& impulses);
  /// Changes state.v so that state.x may move on by h state.v, books the impulses and moves the obstacles on.
  /// `fastest` [m/s]: no node is faster before contact.
  void push_apart(double h, double fastest, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses);

 private:
  struct Active {
    int candidate;
    double least_velocity;  // [m/s] along the normal
  };
  void find_candidates(double farther, const StateOf<Dim>& state);
  void gather_active(double h, StateOf<Dim>& state);
  void apply(const ContactOf<Dim>& contact, const VectorOf<Dim>& impulse, StateOf<Dim>& state) const;
  double sweep(StateOf<Dim>& state);
  void book(const StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const;
  void book(const ContactOf<Dim>& contact, const VectorOf<Dim>& impulse, const StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const;

  ContactSet<Dim> set_;
  Eigen::VectorXd inverse_mass_;
  PointsOf<Dim> impulse_;     // [N s] Dim x slots, of the last substep
  PointsOf<Dim> given_;       // [N s] Dim x slots: what of it came as a force
  bool has_given_ = false;    // in this substep
  double last_h_ = 0;         // [s]
  double shortest_edge_ = 0;  // [m]
  double push_out_speed_ = 0;
  double reach_ = 0;  // [m] that the body may still move before places beyond the candidates can touch
  std::vector<Active> active_;
  std::vector<char> is_candidate_;  // slots
  double pushes_ = 0;
};

}  // namespace hydrostat::physics

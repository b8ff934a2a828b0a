#pragma once

#include <vector>

#include "physics/stepper.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// One generator of contact forces: direction of the force on contact point `point` for a unit coefficient.
struct ContactGenerator {
  int point;
  Eigen::Vector3d force;  // a unit of normal force with its friction
};

/// The generators of frame f: a pyramid of four for each point that holds; for a sliding point the share of friction that sliding
/// settles points against the motion, and the pyramid shrinks to the rest.
std::vector<ContactGenerator> contact_generators(const ContactSchedule& contacts, Eigen::Index frame, double friction,
                                                 double support_friction);

/// Shift of the COM and turn of the trunk per frame.
struct Shift {
  Eigen::MatrixXd move, turn;  // 3 x F [m], [rad]
  double badness = 0;          // RMS missing force per weight, plus missing moment per m g L, plus shift per L
  bool converged = false;
};

/// What a shift costs beside its own size.
struct ShiftCosts {
  double forces = 1;  // share of the usual cost of contact forces, which lets loads come and go gently
  double jerk = 0;    // of the COM's own path, per cost of the shift's jerk: a landing is spread over the frames that can bear it
  double shift = 1;   // share of the usual cost of shift and turn: the less they cost the wider the load is spread over what bears
};

/// The least shift of the COM and turn of the trunk with which gravity, contact forces inside the friction pyramid and momentum, linear
/// and angular, balance in every frame. length [m] is L. What `so_far` has moved and turned before is counted with it: the sum of both is
/// to be least; by default there is none. A one-shot starts from rest and comes to rest at the `ends` that are told to; at others it has
/// the speed that it has, and no acceleration. Source: Kajita's and Wensing's centroidal balance in the form of the design, section 5; weights
/// measured on our clips.
Shift find_shift(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts, double length,
                 double support_friction, int max_pivots = 60, const ShiftCosts& costs = {}, const Shift& so_far = {}, RestingEnds ends = {});

/// Adds a shift to what has been moved and turned before (turns are small).
void add(const Shift& shift, Shift& so_far);

/// The motion with every frame moved and turned about its COM.
Motion shifted(const Motion& motion, const Shift& shift, const physics::Body& body);

/// What the best contact forces leave of each frame's balance: force / (m g), moment about the COM / (m g L); 6 x F.
Eigen::MatrixXd missing_wrench(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts, double length,
                               double support_friction, RestingEnds ends = {});

/// Moves every frame of a flight as a whole so that the COM falls freely between the last and the first frame in contact.
/// A rigid move leaves volume and shape as they are, and in flight no foot holds it back.
void fall_freely(const ContactSchedule& contacts, const physics::Scene& scene, Motion& motion);

}  // namespace hydrostat::retarget

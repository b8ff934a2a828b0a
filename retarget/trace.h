#pragma once

#include <Eigen/Core>

#include "physics/body.h"

namespace hydrostat::retarget {

/// A free simulation written down for an audit: column s of every time course is one row of the trace. Forces and moments are
/// means over the row's interval, which ends at time_s[s]; row 0 is the start, forces zero. S rows, N nodes, E edges; column s
/// of a 3N x S array holds x0 y0 z0 x1 y1 z1 ..., z = 0 in 2D.
struct Trace {
  Eigen::VectorXd time_s;                // S
  Eigen::VectorXd mass_kg;               // N
  Eigen::MatrixXd position;              // [m] 3N x S
  Eigen::MatrixXd velocity;              // [m/s] 3N x S
  Eigen::MatrixXd contact_force;         // [N] 3N x S; self-contact is internal and not in it
  Eigen::MatrixXd effect_force;          // [N] 3N x S; drag, buoyancy, pushes
  Eigen::MatrixXd correction_impulse;    // [N s] 3N x S; any velocity correction that is no force of the scene
  Eigen::Matrix3Xd contact_moment;       // [N m] 3 x S, about the world's origin
  Eigen::Matrix3Xd effect_moment;        // [N m] 3 x S, about the world's origin
  Eigen::MatrixXd activation;            // [-] E x S
  Eigen::Matrix2Xi edges;                // 2 x E
  Eigen::VectorXd rest_length_m;         // E
  Eigen::MatrixXi elements;              // 4 x T tets or 3 x T triangles

  Eigen::Index count() const { return time_s.size(); }
};

/// A trace of a body with room for `rows` rows, forces and moments zero.
template <int Dim>
Trace empty_trace(const physics::BodyOf<Dim>& body, Eigen::Index rows);

/// Cuts off what comes after the first `rows` rows.
void shorten(Trace& trace, Eigen::Index rows);

/// The trace with a row for every `every` of its steps: forces, moments and activations are means over the longer interval, impulses
/// sums. Steps at the end that do not fill an interval are left out.
Trace thinned(const Trace& trace, int every);

}  // namespace hydrostat::retarget

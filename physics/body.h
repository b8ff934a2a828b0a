#pragma once

#include <Eigen/Core>
#include <vector>

namespace hydrostat::physics {

/// A soft body: springs along the edges of a tetrahedral mesh, whose rest lengths are commanded, and volume per tet.
struct Body {
  Eigen::Matrix3Xd rest;                            // rest positions [m] 3 x N
  Eigen::VectorXd mass;                             // [kg] N, > 0
  Eigen::Matrix2Xi edges;                           // 2 x E
  Eigen::VectorXd rest_length;                      // [m] E, > 0
  Eigen::VectorXd edge_stiffness;                   // [N/m] E
  Eigen::VectorXd edge_damping;                     // [N s/m] E, axial dashpot
  Eigen::Matrix4Xi tets;                            // 4 x T, positive volume at rest
  Eigen::Matrix<int, 6, Eigen::Dynamic> tet_edges;  // 6 x T: the edges 01 02 03 12 13 23 of the tet
  Eigen::VectorXd rest_volume;                      // [m3] T, of the whole tet
  Eigen::VectorXd volume_stiffness;                 // [J] T: kappa times the filled volume

  int node_count() const { return static_cast<int>(mass.size()); }
  int edge_count() const { return static_cast<int>(rest_length.size()); }
  int tet_count() const { return static_cast<int>(rest_volume.size()); }
};

struct Material {
  double density = 1000;        // [kg/m3]
  double youngs_modulus = 2e6;  // [Pa]
  double bulk_factor = 4;       // kappa over Young's modulus [-]
  double damping_time = 0.01;   // [s] dashpot over spring
};

/// The body of a tet mesh. `fill` [-] is the share of each tet that is matter: mass and stiffness follow it.
/// Edge e gets k = 6 E V_e / l0^2 with V_e a sixth of the filled volume of the tets around it.
/// `edges` must hold every edge of `tets` once, lower node first, in lexicographic order.
Body make_body(const Eigen::Matrix3Xd& rest, const Eigen::Matrix4Xi& tets, const Eigen::Matrix2Xi& edges,
               const Eigen::VectorXd& fill, const Material& material);

struct State {
  Eigen::Matrix3Xd x;  // [m] 3 x N
  Eigen::Matrix3Xd v;  // [m/s] 3 x N
};

using ConstPoints = Eigen::Ref<const Eigen::Matrix3Xd>;

Eigen::Vector3d centre_of_mass(const Body& body, const ConstPoints& x);
Eigen::Vector3d momentum(const Body& body, const ConstPoints& v);
/// About `about` [m]; kg m2/s.
Eigen::Vector3d angular_momentum(const Body& body, const ConstPoints& x, const ConstPoints& v, const Eigen::Vector3d& about);
Eigen::Matrix3d inertia(const Body& body, const ConstPoints& x, const Eigen::Vector3d& about);
double volume(const Body& body, const ConstPoints& x);
/// det F of every tet [-]; T.
Eigen::VectorXd jacobians(const Body& body, const ConstPoints& x);

}  // namespace hydrostat::physics

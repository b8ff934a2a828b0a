#pragma once

#include <vector>

#include "physics/dimension.h"
#include "physics/element_activation.h"

namespace hydrostat::physics {

/// Finite elements of one shape and one law in a body, strained by the activations of its edges.
template <int Dim>
struct BodyElements {
  ElementBlock<Dim> block;
  ActivationFit<Dim> fit;  // of_element names edges of the body: every pair of nodes of an element must be one
  std::vector<ElementMaterial> materials = {};  // what block was made of, as in ElementMesh
  Eigen::VectorXd fill = {};
};

/// A soft body: springs along the edges of a tetrahedral mesh, whose rest lengths are commanded, and volume per tet; beside
/// them or in their stead finite elements. The tets fill the body whatever bears its stress: its volume, inversion and
/// surface are read from them. In 2D a tet is a triangle, its volume the area times one metre of depth.
template <int Dim>
struct BodyOf {
  PointsOf<Dim> rest;                                               // rest positions [m] Dim x N
  Eigen::VectorXd mass;                                             // [kg] N, > 0
  Eigen::Matrix2Xi edges;                                           // 2 x E
  Eigen::VectorXd rest_length;                                      // [m] E, > 0
  Eigen::VectorXd edge_stiffness;                                   // [N/m] E
  Eigen::VectorXd edge_damping;                                     // [N s/m] E, axial dashpot
  Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> tets;                 // Dim + 1 x T, positive volume at rest
  Eigen::Matrix<int, kEdgesPerTet<Dim>, Eigen::Dynamic> tet_edges;  // x T: the edges 01 02 03 12 13 23 (01 02 12) of the tet
  Eigen::VectorXd rest_volume;                                      // [m3] T, of the whole tet
  Eigen::VectorXd volume_stiffness;                                 // [J] T: kappa times the filled volume; or empty: none
  std::vector<BodyElements<Dim>> elements = {};
  std::vector<int> held = {};  // nodes that stay where they start, each once; what holds them is booked
  Eigen::VectorXd displaced_share = {};  // T, of a tet's volume that keeps a fluid out [-]; empty: all of it
  double wetted_share = 1;               // of the surface of the tets that a fluid's resistance sees [-]

  int node_count() const { return static_cast<int>(mass.size()); }
  int edge_count() const { return static_cast<int>(rest_length.size()); }
  int tet_count() const { return static_cast<int>(rest_volume.size()); }
};
using Body = BodyOf<3>;

struct Material {
  double density = 1000;        // [kg/m3]
  double youngs_modulus = 2e6;  // [Pa]
  double bulk_factor = 4;       // kappa over Young's modulus [-]
  double damping_time = 0.01;   // [s] dashpot over spring
};

/// The body of a tet mesh. `fill` [-] is the share of each tet that is matter: mass and stiffness follow it.
/// Edge e gets k = n E V_e / l0^2 with V_e an n-th of the filled volume of the tets around it, n = 6 edges a tet (3 a
/// triangle): a lattice of such springs has Young's modulus E and the Poisson's ratio of central forces, 1/4 (1/3).
/// `edges` must hold every edge of `tets` once, lower node first, in lexicographic order.
template <int Dim>
BodyOf<Dim> make_body(const PointsOf<Dim>& rest, const Eigen::Matrix<int, Dim + 1, Eigen::Dynamic>& tets,
                      const Eigen::Matrix2Xi& edges, const Eigen::VectorXd& fill, const Material& material);

/// A face of the body's surface: that of a tet across from one of its corners.
struct SurfaceFace {
  int tet, opposite;
};
/// The faces that only one tet has, in an order that hangs on the numbers of their nodes alone.
template <int Dim>
std::vector<SurfaceFace> surface_faces(const BodyOf<Dim>& body);
/// The nodes of such a face, counter-clockwise seen from outside (2D: with the body on their left).
template <int Dim>
Eigen::Matrix<int, Dim, 1> nodes_of_face(const BodyOf<Dim>& body, const SurfaceFace& face);

/// 1 / mass of every node [1/kg], 0 of those that are held; N.
template <int Dim>
Eigen::VectorXd inverse_masses(const BodyOf<Dim>& body);

template <int Dim>
struct StateOf {
  PointsOf<Dim> x;                     // [m] Dim x N
  PointsOf<Dim> v;                     // [m/s] Dim x N
  PointsOf<Dim> obstacle_travel = {};  // [m] Dim x the scene's obstacles: from where the scene has them; empty: none moved
};
using State = StateOf<3>;

template <int Dim>
VectorOf<Dim> centre_of_mass(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x);
template <int Dim>
VectorOf<Dim> momentum(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& v);
/// About `about` [m]; kg m2/s.
template <int Dim>
SpinOf<Dim> angular_momentum(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const ConstPointsOf<Dim>& v,
                             const std::type_identity_t<VectorOf<Dim>>& about);
template <int Dim>
InertiaOf<Dim> inertia(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x,
                       const std::type_identity_t<VectorOf<Dim>>& about);
template <int Dim>
double volume(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x);
/// det F of every tet [-]; T.
template <int Dim>
Eigen::VectorXd jacobians(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x);

}  // namespace hydrostat::physics

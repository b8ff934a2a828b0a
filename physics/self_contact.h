#pragma once

#include <vector>

#include "physics/box_tree.h"
#include "physics/scene.h"
#include "physics/step_work.h"

namespace hydrostat::physics {

/// Finds where a body's surface may touch itself: every node of the surface against the nearest face that is no neighbour of
/// it along the mesh and, in 3D, every edge of the surface against the nearest such edge that it crosses.
///
/// A node that is behind a face is inside the body only as far as the tet there is thick; one that is found within a tet
/// that is no neighbour, as where a fold overlaps at the start, is led out by the face that is nearest to it in the rest
/// shape. Forces are equal and opposite in one point (ContactOf), so that neither momentum nor angular momentum changes.
/// Sources: Bridson, Fedkiw, Anderson, "Robust treatment of collisions, contact and friction for cloth animation", SIGGRAPH
/// 2002, section 6, for nodes against faces and edges against edges; McAdams et al., "Efficient elasticity for character
/// skinning with contact and collisions", SIGGRAPH 2011, section 6, for depth as the rest shape has it.
template <int Dim>
class SelfContactSet {
 public:
  /// Empty where the scene has no self-contact.
  explicit SelfContactSet(const SceneOf<Dim>& scene);

  bool is_empty() const { return slot_count_ == 0; }
  int slot_count() const { return slot_count_; }
  /// Adds to `candidates`, from `first_slot` on, the places that may come to touch while no node moves more than `reach`
  /// [m]. Takes memory only where places have more neighbours than ever before. What is near is gathered somewhat farther
  /// out and kept until the nodes have moved that far. Where nothing is near, it is measured how far apart all stands, and
  /// nothing is looked for until the nodes have moved that far against each other: what the body does as a whole counts for
  /// nothing. No motion hangs on that.
  /// Source: Verlet, "Computer experiments on classical fluids I", Phys. Rev. 159, 1967, for lists that are kept; Mirtich,
  /// "Timewarp rigid body simulation", SIGGRAPH 2000, section 4, for distances that put off the next look.
  void find(const PointsOf<Dim>& x, double reach, int first_slot, std::vector<ContactOf<Dim>>& candidates);
  /// Brings a candidate to `x`: its gap is infinite where it faces nothing.
  void update(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const;
  /// Weighs the nodes anew, as they stand in `x`.
  void carry(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const;
  void forget() { starts_unknown_ = true; }
  /// How deep the body is in itself [m], 0 for not at all, as far as nodes and edges tell; to be asked in every step.
  double deepest(const PointsOf<Dim>& x);
  /// How often the whole surface was looked through so far.
  long searches() const { return searches_; }
  const ContactWork& work() const { return work_; }

 private:
  struct Edge {
    Eigen::Vector2i nodes, faces;
  };
  struct Overlap {  // of a node that is inside another part of the body
    int face = -1, tet = -1;
    VectorOf<Dim> foot;  // weights of the face's nodes
  };
  void find_surface();
  void find_neighbours();
  void find_edges();
  bool may_touch(int node, const int* nodes, int count) const;
  bool is_near(int a, int b) const;
  bool may_meet(int a, int b) const;
  bool stands_apart(const PointsOf<Dim>& x, double reach) const;
  void gather(const PointsOf<Dim>& x, double reach);
  void measure_apart(const PointsOf<Dim>& x);
  template <typename Use>
  void visit_partners(const PointsOf<Dim>& x, int place, double distance, const Use& use) const;
  void find_overlap(const PointsOf<Dim>& x, int place);
  void face_node(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const;
  void face_edge(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const;
  void press_against(const PointsOf<Dim>& x, int tet, ContactOf<Dim>& contact) const;

  const SceneOf<Dim>& scene_;
  int slot_count_ = 0;
  Eigen::VectorXd inverse_mass_;                   // [1/kg] N
  Eigen::Matrix<int, Dim, Eigen::Dynamic> faces_;  // nodes
  std::vector<SurfaceFace> owners_;                // of each face
  std::vector<int> points_;                        // nodes of the surface: the first places
  std::vector<Edge> edges_;                        // the places behind them
  std::vector<int> edge_begin_;                    // faces + 1: of the edges that a face brings
  std::vector<int> point_of_;                      // of each node, or -1
  std::vector<bool> near_;                         // points x N: what is too near along the mesh to touch
  std::vector<int> piece_;                         // of each node: what hangs together has one number
  PointsOf<Dim> face_low_, face_high_, tet_low_, tet_high_;
  BoxTree<Dim> face_tree_, tet_tree_;
  std::vector<int> partner_begin_, partner_end_, partners_;  // of each place: faces, or edges
  std::vector<Overlap> overlaps_;                            // of each point
  std::vector<int> crossed_;                                 // of each edge: which it crossed at the last find, or -1
  std::vector<ContactOf<Dim>> looked_at_;                    // by deepest
  PointsOf<Dim> gathered_at_;                                // where the nodes stood when partners were gathered
  double gathered_reach_ = -1;                               // [m] as far as nodes may have moved since
  double spare_reach_ = 0;                                   // [m] beyond what is asked for
  // [m] that the boxes of any two parts that may touch stood apart along some axis when partners were gathered; 0 where some had any
  double apart_ = 0;
  double farthest_apart_ = 0;  // [m] as far as that is of interest
  long searches_ = 0;
  ContactWork work_;
  bool starts_unknown_ = true, tets_follow_ = false, overlaps_itself_ = false;
};

}  // namespace hydrostat::physics

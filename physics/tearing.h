#pragma once

#include <optional>
#include <vector>

#include "physics/internal_forces.h"
#include "physics/scene.h"
#include "physics/seam.h"

namespace hydrostat::physics {

/// Measures what pulls at the faces of a body's seams.
///
/// The elements that touch a seam are looked at with all its faces apart: what those of one side exert on their copy of a node
/// is a free body's force. Copies that are one node move as one, so that what holds a copy c to the others is
/// m_c / (sum m) sum f - f_c: weight, which goes with the mass, drops out. The sum of that over the nodes of a face, over the
/// area around them (of each node a part of its faces), both as they now stand and along the normal that the marked plane has
/// in the elements beside it, is the tension there (Cauchy's stress, normal . sigma . normal). It is exact for simplices under
/// one stress along the normal, whatever zigzag the plane has become in the mesh. Forces are elastic ones, without the
/// dashpots'.
template <int Dim>
class SeamWatch {
 public:
  /// Of the whole body, `apart` being its mesh with all faces broken. `springs_alone`: as the method 'spring' has it.
  SeamWatch(const FractureOf<Dim>& fracture, const BodyOf<Dim>& whole, const SplitMesh<Dim>& apart, bool springs_alone);
  SeamWatch(const SeamWatch&) = delete;
  SeamWatch& operator=(const SeamWatch&) = delete;

  /// To be called when the body splits: the node that each of the apart mesh's is now.
  void follow(const Eigen::VectorXi& node_now);
  /// The tension on each face [Pa]: places of the body as it now is, activations of the whole one. What is broken (an entry a
  /// face) bears nothing. Allocates nothing.
  const Eigen::VectorXd& tensions(const PointsOf<Dim>& x, const Eigen::VectorXd& activation, const std::vector<char>& is_broken);

 private:
  struct Face {
    int seam = 0, count = 0;
    std::array<int, 4> behind{}, front{};  // nodes of the rim
    // Of the element behind and the one in front: corners that span it, and how far each but the first is before it along the
    // seam's normal at rest [m].
    std::array<std::array<int, Dim + 1>, 2> span{};
    std::array<VectorOf<Dim>, 2> ahead{};
  };
  VectorOf<Dim> normal_of(const Face& face) const;
  void hold_together();
  void measure_seam(int seam, const std::vector<char>& is_broken);

  std::vector<int> nodes_;  // of the apart mesh: the rim, that is all nodes of elements that touch a seam
  BodyOf<Dim> rim_;
  std::optional<InternalForces<Dim>> forces_;
  Eigen::VectorXi whole_edges_;           // of each constraint of the rim
  std::vector<Face> faces_;
  std::vector<std::vector<int>> behind_;  // of each seam: the nodes behind it, each once
  std::vector<int> node_now_, first_;     // of each node of the rim: of the body; the first of the rim that is the same
  Eigen::VectorXd activation_, mass_, tension_;
  PointsOf<Dim> x_, force_, sum_, pull_, area_;
};

/// A body that splits while it is simulated: which faces are broken, and what its nodes are numbers of.
template <int Dim>
class Tearing {
 public:
  Tearing(const FractureOf<Dim>& fracture, const BodyOf<Dim>& whole, bool springs_alone);

  /// Breaks each face that bears more than its seam's strength, for good. Returns how many of each seam broke now, or nothing
  /// where none did. State of the body as it now is, activations of the whole one.
  std::vector<int> break_loaded(const StateOf<Dim>& state, const Eigen::VectorXd& activation);
  /// Makes the scene's body, its surface and self-contact, and the state what they have become; masses, places and velocities
  /// are kept, and with them all momentum and energy. Returns false, and leaves all as it is, where no node has come apart.
  bool split(SceneOf<Dim>& scene, StateOf<Dim>& state);
  int part_count() const { return count_parts(now_.mesh.nodes); }

  /// With all faces broken.
  const BodyOf<Dim>& apart() const { return apart_body_; }
  const Eigen::VectorXi& apart_origin() const { return apart_.origin; }
  /// Of each node of the body as it now is, which of the whole one's.
  const Eigen::VectorXi& origin_now() const { return now_.origin; }
  /// Of each node of the apart body: which of the body as it now is, and its share of that one's mass.
  const Eigen::VectorXi& node_now() const { return node_now_; }
  const Eigen::VectorXd& mass_share() const { return mass_share_; }
  /// Of each constraint, which of the whole body's: of the body as it now is, of the apart one.
  const Eigen::VectorXi& edges_now() const { return edges_now_; }
  const Eigen::VectorXi& apart_edges() const { return apart_edges_; }

 private:
  void number_nodes(const BodyOf<Dim>& body);

  const FractureOf<Dim>& fracture_;
  const BodyOf<Dim> whole_;
  std::vector<char> is_broken_;
  SplitMesh<Dim> now_, apart_;
  BodyOf<Dim> apart_body_;
  Eigen::VectorXi node_now_, edges_now_, apart_edges_;
  Eigen::VectorXd mass_share_;
  SeamWatch<Dim> watch_;
};

}  // namespace hydrostat::physics

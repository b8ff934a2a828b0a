#pragma once

#include <Eigen/LU>
#include <vector>

#include "physics/internal_forces.h"
#include "physics/stepper.h"
#include "physics/system_matrix.h"
#include "retarget/contacts.h"
#include "retarget/muscles.h"

namespace hydrostat::retarget {

/// What a body's velocities become by each muscle over the corrector's horizon, A^-1 Th B Phi with A = M + Th D + Th^2 (K + Kc),
/// where Kc holds the points that touch the ground.
///
/// A, its factor and the response are made at one state and kept for some calls, for on the path they hardly change. What touches changes
/// from call to call; with J the rows of what came or went and c = Th^2 k its stiffness, that is exact at little cost:
///
///   (A + J^T C J)^-1 = A^-1 - Z (C^-1 + J Z)^-1 Z^T,   Z = A^-1 J^T,   C = +c for what came, -c for what went.
///
/// Source: Hager, "Updating the Inverse of a Matrix", SIAM Review 31(2), 1989 (Woodbury's formula).
class MuscleResponse {
 public:
  /// contact_stiffness [N/m] of a point; node_shares: 3N, the weights of the rows of node_normal(). Scene and muscles must outlive it.
  MuscleResponse(const physics::Scene& scene, const Muscles& muscles, double horizon_s, double contact_stiffness,
                 Eigen::VectorXd node_shares);

  /// Brings it to what touches now (one state a point), made anew at this state where it was kept for `calls` calls or too much
  /// touches otherwise. `forces` have the activations. False where the system cannot be factored.
  bool update(const physics::State& state, physics::InternalForces<3>& forces, const std::vector<ContactState>& touching,
              int calls);
  void forget() { is_made_ = false; }

  /// 3N x muscles [m/s per unit of a muscle].
  const Eigen::MatrixXd& velocities() const { return velocities_; }
  /// R^T W R of these velocities, muscles x muscles; only the lower triangle counts.
  const Eigen::MatrixXd& node_normal();
  /// x <- A^-1 x, of 3N.
  void solve_in_place(Eigen::VectorXd& x) const;

 private:
  /// What the muscles do to the constraints of one element.
  struct ElementFields {
    std::vector<Eigen::Index> muscles;
    Eigen::MatrixXd fields;  // pairs x muscles
  };
  /// A direction in which a contact point holds now and did not when the system was made (sign 1), or the other way round (-1).
  struct Change {
    int point;
    double sign;
    Eigen::Vector3d direction;
  };
  void find_fields();
  bool make(const physics::State& state, physics::InternalForces<3>& forces, const std::vector<ContactState>& touching);
  bool factor(const physics::State& state, physics::InternalForces<3>& forces, const std::vector<ContactState>& touching);
  void add_springs(const physics::State& state);
  void add_elements(const physics::State& state, const physics::InternalForces<3>& forces);
  void find_changes(const std::vector<ContactState>& touching);
  void apply_changes();
  void find_made_normal();
  /// J x, of so many columns.
  Eigen::MatrixXd along_changes(const Eigen::MatrixXd& x) const;

  const physics::Scene& scene_;
  const Muscles& muscles_;
  double horizon_s_, contact_stiffness_;
  Eigen::VectorXd node_shares_;
  physics::SystemMatrix matrix_;
  std::vector<std::vector<int>> springs_of_;                // of each muscle: the springs that it shortens
  std::vector<std::vector<ElementFields>> element_fields_;  // of the elements of each block
  bool is_made_ = false;
  int age_ = 0;                           // calls since it was made
  std::vector<ContactState> touching_;    // when it was made
  std::vector<ContactState> touching_now_;
  Eigen::MatrixXd made_, made_normal_;    // velocities and, where they were asked for, their products then
  std::vector<Change> changes_;           // since then
  Eigen::MatrixXd held_;                  // Z, 3N x changes
  Eigen::MatrixXd taken_;                 // (C^-1 + J Z)^-1 J made_, changes x muscles
  Eigen::PartialPivLU<Eigen::MatrixXd> capacitance_;  // C^-1 + J Z
  Eigen::MatrixXd velocities_, node_normal_, scaled_;
  bool is_normal_made_ = false, is_normal_current_ = false;  // whether made_normal_ and node_normal_ belong to what is there now
  Eigen::Matrix3Xd pull_;                 // 3 x E [N s]: of a spring's unit activation over the horizon
};

}  // namespace hydrostat::retarget

#pragma once

#include "physics/internal_forces.h"
#include "physics/stepper.h"
#include "retarget/contacts.h"
#include "retarget/cost_to_go.h"
#include "retarget/muscle_response.h"

namespace hydrostat::retarget {

struct CorrectorOptions {
  double horizon_s = 1.0 / 30;  // Th
  double settle_s = 0.3;        // tau
  double node_weight = 0.2;     // of the mass rows
  double root_weight = 6;       // of the six rows of momentum
  double effort = 5;            // eps, per squared muscle, with speeds per sqrt(g L)
  double calm = 3;              // how many times dearer effort gets as the error of momentum vanishes,
  double calm_error = 0.01;     // halfway at this error, in speeds per sqrt(g L)
  double change = 1e-3;         // eps_d, per squared change of a muscle
  double cone_weight = 10;      // per m g by which the force at a point that is to bear load would leave its friction cone
  double foot_weight = 4;       // of the rows of a foot in the air
  double foot_settle_s = 0.1;   // tau of a foot in the air
  double step = 1;              // share of the error of the centre of mass that a foot in the air makes its own
  double clearance = 0.03;      // of L: over what a foot in the air is to step onto or across
  double step_ahead = 1.75;     // of sqrt(h / g): how far ahead of its error the centre of mass is met
  double long_step = 0.15;      // of h: what is longer is stepped at once, whatever the plan; infinite: never
  int response_every = 4;       // calls for which the muscles' response is kept while the error is below calm_error
  RegulatorOptions regulator;   // that takes the place of all that but the cones, within its reach
  bool operator==(const CorrectorOptions&) const = default;
};

/// What contact does when muscles are corrected, and what it is to do.
struct ContactNow {
  std::vector<ContactState> touching;  // P: a sliding point holds the body up but not back
  Eigen::Matrix3Xd force;              // 3 x P [N], of the control step before
  std::vector<bool> bearing;           // P: by plan it bears load now and until the horizon's end
  std::vector<bool> on_leg;            // P: of a patch on a leg
  std::vector<const Patch*> in_air;    // patches on legs that touch nothing; they must outlive the call
  std::vector<Eigen::Vector3d> lead;   // [m] of each of them: by how much what lies ahead moves it from its reference; empty: not
  double grip = 1;  // in [0, 1], weighs the rows of horizontal momentum: where contacts are meant to slide,
                    // friction sets the ground's sideways force, and pushing harder only slips more
  double upright = 1;  // in [0, 1], weighs the rows of pitch and roll
};

/// Feedback on the muscles in deviation form: nothing on the nominal path.
///
/// dv_free = A^-1 [M ev + Th (f_int(x; a_ff) - f_int(x_ref; a_ff))], A = M + Th D + Th^2 (K + Kc on the points that touch
/// now), min_w |W (dv_free + A^-1 Th B Phi w + ex / tau)|^2 + eps |w|^2 + eps_d |w - w_previous|^2 + the squared excess of
/// contact forces over their cones (contact_cones.h). Effort is dear while the error is small, for a creature on a narrow base
/// sways against a gain that a push calls for. W weighs the nodes by mass, the six rows of momentum, and the mean of
/// each foot in the air, which is sent to where the centre of mass can be caught: its error moves by e + c sqrt(h / g) e'
/// with the error e of the centre of mass over the ground and its height h. Where that is a long step the feet come down at once, for
/// the plan's swing ends when the body has fallen past them, and every foot that touches is asked to stay within its cone, for then
/// the plan does not know which of them bear. Sources: the design, section 8; Raibert, "Legged
/// Robots That Balance", 1986, for the placement of feet by speed; Pratt et al., "Capture Point: A Step toward Humanoid Push
/// Recovery", Humanoids 2006, for the way that sqrt(h / g) gives.
///
/// Where a cost to go is known, regulate() takes the place of that target: min_w z' S z + effort |w|^2 + the excess over cones, of
/// the deviation z after one control step (horizon_s), by the same response, so that what touches counts as it is and not as planned.
/// Here dv_free has the dashpots' forces too, and the difference of forces is to CostToGo::settled: internal forces that do not balance, or some
/// of them alone, would turn with the body and be taken for a moment on it.
/// What such steps turn out to miss is taken for a disturbance that lasts a while: of another body, of what the plan left out. It fades
/// (RegulatorOptions::keep), so that it lessens what a body is off for good and does not end it. Source: Muske, Badgwell, "Disturbance
/// modeling for offset-free linear model predictive control", Journal of Process Control 12, 2002.
class Corrector {
 public:
  /// length [m] is L. Scene and muscles must outlive the corrector.
  Corrector(const physics::Scene& scene, const Muscles& muscles, double length, double limit,
            const CorrectorOptions& options);

  /// Adds the correction to `activation` (E, the feed-forward on entry), clamped to the limit. Returns the RMS of the
  /// muscles' correction.
  double correct(const physics::State& state, const physics::State& reference, const ContactNow& contact,
                 Eigen::VectorXd& activation);
  /// The same by what deviations cost from the time [s] on; `heading` turns the motion's first period into this one.
  double regulate(const CostToGo& cost, double time_s, const Eigen::Matrix3d& heading, const physics::State& state,
                  const physics::State& reference, const ContactNow& contact, Eigen::VectorXd& activation);
  void reset();
  /// What acted in its stead, of each muscle.
  void follow(const Eigen::VectorXd& muscles);
  const Eigen::VectorXd& muscles_now() const { return previous_; }
  /// How far inside their cones the forces at bearing points stay over the horizon, by the last correction's own model [m
  /// g]; negative outside, 0 where nothing bears.
  double least_margin() const;

 private:
  void solve_free_deviation(const Eigen::Matrix3Xd& velocity);
  void find_free_deviation(const physics::State& state, const physics::State& reference);
  void find_free_deviation_of_settled(const physics::State& state, const physics::State& settled);
  double weigh_momentum(const physics::State& state, const ContactNow& contact);
  void find_step(const physics::State& state, const physics::State& reference);
  void weigh_feet(const physics::State& state, const physics::State& reference, const ContactNow& contact);
  std::vector<bool> held_to_cones(const ContactNow& contact) const;
  bool begin(const physics::State& state, const ContactNow& contact, const Eigen::VectorXd& activation, int response_every);
  void learn_disturbance(const Eigen::VectorXd& deviation);
  void find_cones(const ContactNow& contact);
  double act(const Eigen::MatrixXd& left, const Eigen::VectorXd& right, Eigen::VectorXd& activation);

  const physics::Scene& scene_;
  const Muscles& muscles_;
  CorrectorOptions options_;
  double length_, speed_unit_, limit_, contact_stiffness_;
  Eigen::VectorXd node_shares_;  // 3N: the squared weight of each row of nodes
  MuscleResponse responses_;
  physics::InternalForces<3> forces_;
  double momentum_error_ = 0;      // at the last call, in speeds per sqrt(g L)
  Eigen::VectorXd deviation_;      // 3N: the change of velocity that comes without any muscle, later with the error of place
  Eigen::Vector3d step_ = Eigen::Vector3d::Zero();  // [m] over the ground, by which a foot in the air is to land elsewhere
  double haste_ = 0;               // 0 where that is no long step, 1 from twice a long one on
  Eigen::MatrixXd weighted_, normal_, cones_;  // weighted_: the few rows beside the nodes', x (muscles + 1)
  Eigen::VectorXd previous_;
  Eigen::VectorXd predicted_, disturbance_;  // 2R: z as predicted at a regulator's last step, and what is learned of its errors; none before the first
  Eigen::Matrix3Xd force_, reference_force_;
};

}  // namespace hydrostat::retarget

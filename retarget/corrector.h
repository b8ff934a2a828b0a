#pragma once

#include "physics/internal_forces.h"
#include "physics/stepper.h"
#include "retarget/contacts.h"
#include "retarget/muscles.h"

namespace hydrostat::retarget {

struct CorrectorOptions {
  double horizon_s = 1.0 / 30;  // Th
  double settle_s = 0.3;        // tau
  double node_weight = 0.2;     // of the mass rows
  double root_weight = 6;       // of the six rows of momentum
  double effort = 5;            // eps, per squared muscle, with speeds per sqrt(g L)
  double change = 1e-3;         // eps_d, per squared change of a muscle
};

/// Feedback on the muscles in deviation form: nothing on the nominal path.
///
/// dv_free = A^-1 [M ev + Th (f_int(x; a_ff) - f_int(x_ref; a_ff))], A = M + Th D + Th^2 (K + Kc on the points that touch now),
/// min_w |W (dv_free + A^-1 Th B Phi w + ex / tau)|^2 + eps |w|^2 + eps_d |w - w_previous|^2. Source: the design, section 8.
class Corrector {
 public:
  /// length [m] is L. Scene and muscles must outlive the corrector.
  Corrector(const physics::Scene& scene, const Muscles& muscles, double length, double limit, const CorrectorOptions& options);

  /// Adds the correction to `activation` (E, the feed-forward on entry), clamped to the limit. `touching` P says what each contact
  /// point does now: a sliding one holds the body up but not back. `grip` in [0, 1] weighs the rows of horizontal
  /// momentum: where contacts are meant to slide, friction sets the ground's sideways force, and pushing harder only slips more. Returns the RMS of the muscles' correction.
  double correct(const physics::State& state, const physics::State& reference, const std::vector<ContactState>& touching, double grip,
                 Eigen::VectorXd& activation);
  void reset() { previous_.setZero(); }
  const Eigen::VectorXd& muscles_now() const { return previous_; }

 private:
  /// What the muscles do to the constraints of one element.
  struct ElementFields {
    std::vector<Eigen::Index> muscles;
    Eigen::MatrixXd fields;  // pairs x muscles
  };
  void add_response_of_springs(const physics::State& state);
  void add_response_of_elements(const physics::State& state);

  const physics::Scene& scene_;
  const Muscles& muscles_;
  CorrectorOptions options_;
  double speed_unit_, limit_, contact_stiffness_;
  physics::SystemMatrix matrix_;
  physics::InternalForces<3> forces_;
  std::vector<std::vector<ElementFields>> element_fields_;  // of the elements of each block
  Eigen::MatrixXd response_, weighted_, normal_;
  Eigen::VectorXd free_, previous_;
  Eigen::Matrix3Xd force_, reference_force_;
};

}  // namespace hydrostat::retarget

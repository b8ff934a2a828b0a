#pragma once

#include "physics/stepper.h"
#include "retarget/contacts.h"
#include "retarget/run_report.h"

namespace hydrostat::retarget {

inline constexpr double kMostShift = 0.04;  // of L (RMS): by more preparation is not to move the imported motion

struct PrepareOptions {
  double smooth_hz = 10;         // cut-off of the smoothing (half amplitude)
  double support_friction = 0.7; // of the ground's friction that the plan may use; 5 % more in a far leap
  double firmness = 1;           // of the pull to the animator's shape, against springs that would be rid of their stress
  bool spread_load = false;      // over all that bears, which keeps the middle of pressure off its edge and moves the clip further
  int rounds = 3;                // of volume and momentum
  double clearance = 0.015;      // per D: what is not in contact stays that far above the ground, fading towards contacts
  int clearance_frames = 4;      // over which it fades
  double reach = 0.45;           // strain to which constraints are held where a clip needs more
  bool volume = true, momentum = true;  // off only for ablations
  ContactOptions contacts;
};

/// A target that physics can do, with what it still lacks.
struct PreparedTarget {
  Motion target;             // nodes
  ContactSchedule contacts;  // labels for the scene's contact points
  Eigen::MatrixXd missing_wrench;  // 6 x F: force / (m g), moment about the COM / (m g L)
  Eigen::VectorXd mass_shares;     // N, in (0, 1]: what of their mass the nodes keep so that the body stands; none: all
  PreparationReport report;
  std::vector<std::string> warnings;
  RestingEnds ends = {};           // of a one-shot: where it is balanced as standing still
  double support_friction = 0.7;   // of the ground's friction that it uses
  double firmness = 1;             // by which it was prepared, in times the usual
  double stiffness = 1;            // of the body that carries its weight, in times the usual
};

/// Smooths, locks feet, restores volume and shifts the centre of mass and turns the trunk until gravity, contact forces inside
/// the friction pyramid and momentum balance. The ground is y = 0; `patch_bone` has the bone of each contact point of
/// `scene`, `node_bone_weights` B x N says which bone owns which node. length [m] is L, size [m] is D.
/// Source: Kajita's and Wensing's centroidal balance in the form of the design, section 5; weights measured on our clips.
PreparedTarget prepare(const Motion& coupled, const physics::Scene& scene, const std::vector<int>& patch_bone,
                       const std::vector<std::string>& bone_names, const Eigen::MatrixXd& node_bone_weights, double length,
                       double size, const PrepareOptions& options);

}  // namespace hydrostat::retarget

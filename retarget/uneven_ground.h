#pragma once

#include <vector>

#include "physics/scene.h"
#include "retarget/best_fit_rotation.h"
#include "retarget/contacts.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// What stands on the level ground of the plan, as feet meet it: the reference is raised and tilted as a rigid body to the plane
/// through the ground under the feet, and a foot in the air is lifted over what lies ahead of it until it lands.
/// What is higher than a tenth of L is a wall, not a step, and is left alone.
class UnevenGround {
 public:
  /// length [m] is L, clearance per L. Scene and plan must outlive this.
  UnevenGround(const physics::Scene& scene, const PreparedTarget& plan, double length, double clearance);

  /// Takes in where the feet are after `seconds` more; `fit` leads from the target at time_s to the body.
  void look(double time_s, double seconds, const RigidFit& fit, const physics::State& state);
  /// Raises and tilts a reference whose centre of mass is `com`.
  void apply(const Eigen::Vector3d& com, physics::State& reference) const;
  /// By how much feet are to be moved from that reference [m]: lifted, drawn aside from an edge, and held before a riser until they are
  /// over it. Errors of place are to be made up for within `settle_s`.
  void lead(const std::vector<const Patch*>& feet, const physics::State& state, const physics::State& reference, double settle_s,
            std::vector<Eigen::Vector3d>& moves) const;
  /// Height [m] of the top at a place over the level ground.
  double height_at(const Eigen::Vector3d& place, const physics::State& state) const;

 private:
  struct Foot {
    const Patch* patch;
    std::size_t index;            // of the plan's patches
    std::vector<int> points;      // of the patch, the outermost to four sides
    double ground = 0;            // [m] under it, or where it lands; smoothed
    double lift = 0;              // [m] over the level ground
    Eigen::Vector3d aside = Eigen::Vector3d::Zero();  // [m] from where it would land to where it is to
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // of its middle
  };
  long frames_to_landing(const Foot& foot, double time_s) const;
  double highest(const Foot& foot, double time_s, const RigidFit& fit, const physics::State& state) const;
  double choose_foothold(Foot& foot, double time_s, const RigidFit& fit, const physics::State& state);
  void look_ahead(Foot& foot, double time_s, double seconds, const RigidFit& fit, const physics::State& state);
  double missing_height(const Patch& patch, const Eigen::Vector3d& way, const physics::State& state) const;
  Eigen::Vector3d hold(const Foot& foot, const physics::State& state, const physics::State& reference, double settle_s) const;
  double plane_at(const Eigen::Vector3d& place) const;

  const physics::Scene& scene_;
  const PreparedTarget& plan_;
  const double length_, clearance_;
  const Motion points_;     // the contact points in the target
  const MotionCurve curve_;
  std::vector<Foot> feet_;
  Eigen::Vector3d plane_ = Eigen::Vector3d::Zero();  // height at centre_ [m] and slopes along x and z
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  bool is_first_ = true;
};

}  // namespace hydrostat::retarget

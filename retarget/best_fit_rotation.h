#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "physics/body.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// The rotation R that takes `rest` closest to `positions` [m] (3 x N each) about their centres of mass, weighted by `mass`
/// [kg] (N, >= 0): the minimum over R of sum m |R (X - X_com) - (x - x_com)|^2, never a reflection. Source: Kabsch, "A
/// solution for the best rotation to relate two sets of vectors", Acta Cryst. A32, 1976.
Eigen::Matrix3d best_fit_rotation(const Eigen::Ref<const Eigen::Matrix3Xd>& rest,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& positions,
                                  const Eigen::Ref<const Eigen::VectorXd>& mass);

/// How cloud a comes to lie closest to cloud b: turned about its mean, which is put on that of b.
struct RigidFit {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d mean_a, mean_b;
  double rms;  // what is left [unit of a]
};

/// The same rotation with all that belongs to it, of a's points to b's (3 x N each); `weights` N, sum 1.
RigidFit best_rigid_fit(const physics::ConstPoints& a, const physics::ConstPoints& b, const Eigen::VectorXd& weights);

/// best_fit_rotation of every frame as unit quaternions, each on the hemisphere of the one before it, the first with w >= 0.
std::vector<Eigen::Quaterniond> best_fit_rotations(const Eigen::Ref<const Eigen::Matrix3Xd>& rest, const Motion& motion,
                                                   const Eigen::Ref<const Eigen::VectorXd>& mass);

}  // namespace hydrostat::retarget

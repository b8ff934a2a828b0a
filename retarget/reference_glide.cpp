#include "retarget/reference_glide.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kReach = 0.04, kLeastReach = 0.005;  // per L
constexpr double kFullTurn = 0.1;                     // [rad] at the full reach
constexpr double kLeak = 0.3;                         // [1/s]
constexpr double kSpeed = 0.15;                       // of the target's RMS speed

}  // namespace

double yaw_of(const Eigen::Matrix3d& rotation) {
  return std::atan2(rotation(0, 2) - rotation(2, 0), rotation(0, 0) + rotation(2, 2));
}

void ReferenceGlide::follow(const RigidFit& fit, double seconds) {
  const Eigen::Vector3d error = fit.mean_b - fit.mean_a;
  const double away = std::hypot(error.x() - x, error.z() - z);
  if (away > reach) {
    const double share = (away - reach) / away;
    x += share * (error.x() - x);
    z += share * (error.z() - z);
  }
  const double turn = std::remainder(yaw_of(fit.rotation) - yaw, 2 * M_PI);
  if (std::abs(turn) > turn_reach) yaw += turn - std::copysign(turn_reach, turn);
  const double keep = std::exp(-kLeak * seconds);
  x *= keep, z *= keep, yaw *= keep;
}

void ReferenceGlide::apply(const Eigen::Vector3d& com, physics::State& reference) const {
  if (x == 0 && z == 0 && yaw == 0) return;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  for (Eigen::Index i = 0; i < reference.x.cols(); ++i) {
    const Eigen::Vector3d arm = reference.x.col(i) - com, speed = reference.v.col(i);
    reference.x.col(i) = com + Eigen::Vector3d(x, 0, z) + turn * arm;
    reference.v.col(i) = turn * speed;
  }
}

ReferenceGlide make_glide(double speed, double settle_s, double length) {
  ReferenceGlide glide;
  glide.reach = std::clamp(kSpeed * speed * settle_s, kLeastReach * length, kReach * length);
  glide.turn_reach = kFullTurn * glide.reach / (kReach * length);
  return glide;
}

ReferenceGlide glide_for(const PreparedTarget& plan, double settle_s, double length) {
  const double nodes = static_cast<double>(plan.target.frames.rows()) / 3;
  const double speed = is_dragged(plan.contacts) ? 0 : std::sqrt(velocities(plan.target).colwise().squaredNorm().mean() / nodes);
  return make_glide(speed, settle_s, length);
}

}  // namespace hydrostat::retarget

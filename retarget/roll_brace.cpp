#include "retarget/roll_brace.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kSlender = 2;     // what is less slender rolls about no axis of its own
constexpr double kByRoll = 0.6;    // activation per radian of roll
constexpr double kByRate = 1.35;   // the same per radian in the time sqrt(h / g)
constexpr double kIdle = 0.1;      // less is left alone: a crawl rolls by as much, and what answers to it rocks on
constexpr double kMost = 0.39;     // activation
constexpr double kSmoothing = 1.0 / 3;  // of sqrt(h / g)
constexpr double kOwnPlane = 0.4;  // share of the body's own side in that to which it bends; the rest is level

Eigen::Vector3d level_left_of(const Eigen::Vector3d& way) { return Eigen::Vector3d::UnitY().cross(way).normalized(); }

}  // namespace

RollBrace::RollBrace(const PreparedTarget& plan, const physics::Body& body, double gravity) {
  if (!is_dragged(plan.contacts) || gravity <= 0) return;
  const LongAxis axis = long_axis(body, plan.target);
  if (axis.slenderness < kSlender) return;
  along_ = axis.along;
  bends_ = bends_across(axis, body.edges);
  bends_ /= (bends_ * level_left_of(along_)).cwiseAbs().maxCoeff();
  if (plan.target.yaw != 0) turn_per_s_ = plan.target.yaw / plan.target.duration_s();
  swing_s_ = std::sqrt(std::max(0.0, physics::centre_of_mass(body, plan.target.at(0)).y()) / gravity);
}

void RollBrace::follow(const RigidFit& fit, double time_s, double seconds) {
  if (!is_needed()) return;
  const Eigen::Matrix3d turned = fit.rotation * Eigen::AngleAxisd(turn_per_s_ * time_s, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d up = turned.col(1), way = turned * along_, left = level_left_of(way);
  const double before = roll_;
  roll_ = std::atan2(left.dot(up), up.y());
  const double rate = std::remainder(roll_ - before, 2 * M_PI) / seconds;
  const double wanted = -(kByRoll * roll_ + kByRate * swing_s_ * rate);
  const double most = std::clamp(std::abs(wanted) - kIdle, 0.0, kMost);
  bend_ += (std::copysign(most, wanted) - bend_) * std::min(1.0, seconds / (kSmoothing * swing_s_));
  side_ = ((1 - kOwnPlane) * (turned.transpose() * left) + kOwnPlane * level_left_of(along_)).normalized();
}

void RollBrace::apply(Eigen::VectorXd& activation) const {
  if (bend_ != 0) activation += bend_ * (bends_ * side_);
}

}  // namespace hydrostat::retarget

#include "retarget/roll_brace.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kSlender = 2;       // what is less slender rolls about no axis of its own
constexpr double kByRoll = 0.6;      // activation per radian of roll
constexpr double kByRate = 0.7;      // the same per radian in the time sqrt(h / g)
constexpr double kTrunk = 0.3;       // share of the trunk's own rate in that; the rest is the body's momentum about the ground
constexpr double kIdle = 0.1;        // less is left alone: a crawl rolls by as much, and what answers to it rocks on
constexpr double kMostBrace = 0.5;   // activation
constexpr double kSmoothing = 0.15;  // of sqrt(h / g)
constexpr double kOwnPlane = 0.4;    // share of the body's own side in that to which it bends; the rest is level

Eigen::Vector3d level_left_of(const Eigen::Vector3d& way) { return Eigen::Vector3d::UnitY().cross(way).normalized(); }

/// [m] on the ground, below the centre of mass.
Eigen::Vector3d foot_point(const physics::Scene& scene, const physics::State& state) {
  Eigen::Vector3d point = physics::centre_of_mass(scene.body, state.x);
  point.y() = scene.ground.offset;
  return point;
}

/// Angular momentum [kg m2/s] about the level line across `left` through that point.
double rolling_momentum(const physics::Scene& scene, const physics::State& state, const Eigen::Vector3d& left) {
  return left.cross(Eigen::Vector3d::UnitY()).dot(physics::angular_momentum(scene.body, state.x, state.v, foot_point(scene, state)));
}

/// Moment of inertia [kg m2] about that line.
double rolling_inertia(const physics::Scene& scene, const physics::State& state, const Eigen::Vector3d& left) {
  const Eigen::Vector3d way = left.cross(Eigen::Vector3d::UnitY());
  return way.dot(physics::inertia(scene.body, state.x, foot_point(scene, state)) * way);
}

}  // namespace

RollBrace::RollBrace(const PreparedTarget& plan, const physics::Scene& scene) : scene_(scene) {
  const physics::Body& body = scene.body;
  const double gravity = scene.gravity.norm();
  if (!is_dragged(plan.contacts) || gravity <= 0) return;
  const LongAxis axis = long_axis(body, plan.target);
  if (axis.slenderness < kSlender) return;
  along_ = axis.along;
  bends_ = bends_across(axis, body.edges);
  bends_ /= (bends_ * level_left_of(along_)).cwiseAbs().maxCoeff();
  if (plan.target.yaw != 0) turn_per_s_ = plan.target.yaw / plan.target.duration_s();
  swing_s_ = std::sqrt(std::max(0.0, physics::centre_of_mass(body, plan.target.at(0)).y() - scene.ground.offset) / gravity);
}

void RollBrace::follow(const RigidFit& fit, const physics::State& reference, const physics::State& state, double time_s, double seconds) {
  if (!is_needed()) return;
  const Eigen::Matrix3d meant(Eigen::AngleAxisd(turn_per_s_ * time_s, Eigen::Vector3d::UnitY())), turned = fit.rotation * meant;
  const Eigen::Vector3d up = turned.col(1), left = level_left_of(turned * along_);
  const double before = roll_;
  roll_ = std::atan2(left.dot(up), up.y());
  const double momentum = rolling_momentum(scene_, state, left) - rolling_momentum(scene_, reference, level_left_of(meant * along_));
  const double inertia = rolling_inertia(scene_, state, left);
  const double of_all = inertia > 0 ? -momentum / inertia : 0, of_trunk = std::remainder(roll_ - before, 2 * M_PI) / seconds;
  const double rate = kTrunk * of_trunk + (1 - kTrunk) * of_all;
  const double wanted = -(kByRoll * roll_ + kByRate * swing_s_ * rate);
  const double most = std::clamp(std::abs(wanted) - kIdle, 0.0, kMostBrace);
  bend_ += (std::copysign(most, wanted) - bend_) * std::min(1.0, seconds / (kSmoothing * swing_s_));
  side_ = ((1 - kOwnPlane) * (turned.transpose() * left) + kOwnPlane * level_left_of(along_)).normalized();
}

void RollBrace::apply(Eigen::VectorXd& activation) const {
  if (bend_ != 0) activation += bend_ * (bends_ * side_);
}

}  // namespace hydrostat::retarget

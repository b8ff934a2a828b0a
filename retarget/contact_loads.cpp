#include "retarget/contact_loads.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "retarget/gravity.h"

namespace hydrostat::retarget {
namespace {

constexpr double kPointLoad = 1e-6, kPatchLoad = 0.01;  // [m g]
constexpr double kFarAway = 1e300;                      // [m]
constexpr double kSink = 5e-4, kSinkTime = 1.0 / 30;    // of L; [s]
constexpr double kStillSpeed = 0.01;                    // of sqrt(g L): a loaded patch that moves faster slides

/// Velocity of a contact point along the ground.
Eigen::Vector3d level_velocity(const physics::Scene& scene, const physics::State& state, int point) {
  const Eigen::Vector3d velocity = scene.contact_points.of(state.v, point);
  return velocity - scene.ground.normal.dot(velocity) * scene.ground.normal;
}

}  // namespace

ContactThresholds contact_thresholds(const physics::Scene& scene, double length, double seconds) {
  const double weight = scene.body.mass.sum() * gravity_unit(scene), wave_speed = std::sqrt(gravity_unit(scene) * length);
  return {kPointLoad * weight * seconds, kPatchLoad * weight * seconds, kStillSpeed * wave_speed};
}

double gravity_unit(const physics::Scene& scene) {
  const double gravity = scene.gravity.norm();
  return gravity > 0 ? gravity : kGravity;
}

double contact_stiffness(const physics::Scene& scene, double length, double horizon_s) {
  return scene.body.mass.sum() * gravity_unit(scene) / (kSink * length) * std::pow(kSinkTime / horizon_s, 2);
}

double height_above_ground(const physics::Scene& scene, const physics::State& state, int point) {
  const Eigen::Vector3d place = scene.contact_points.of(state.x, point);
  double height = scene.has_ground ? scene.ground.normal.dot(place) - scene.ground.offset : kFarAway;
  Eigen::Vector3d normal;
  for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
    const physics::ObstacleOf<3>& obstacle = scene.obstacles[o];
    Eigen::Vector3d travel = Eigen::Vector3d::Zero();
    if (state.obstacle_travel.cols() > 0) travel = state.obstacle_travel.col(static_cast<Eigen::Index>(o));
    if (physics::distance_at_least<3>(obstacle, travel, place) >= height) continue;
    height = std::min(height, physics::signed_distance<3>(obstacle, travel, place, normal));
  }
  return height;
}

std::vector<ContactState> point_states(const physics::Scene& scene, const physics::State& state,
                                       const Eigen::Matrix3Xd& impulse, const ContactThresholds& thresholds) {
  std::vector<ContactState> states(static_cast<std::size_t>(impulse.cols()), ContactState::kOff);
  for (int p = 0; p < impulse.cols(); ++p) {
    if (impulse.col(p).norm() <= thresholds.point_impulse) continue;
    const bool slides = level_velocity(scene, state, p).norm() > thresholds.sliding_speed;
    states[static_cast<std::size_t>(p)] = slides ? ContactState::kSlide : ContactState::kStick;
  }
  return states;
}

PatchLoad patch_load(const physics::Scene& scene, const Patch& patch, const physics::State& state,
                     const Eigen::Matrix3Xd& impulse) {
  PatchLoad load;
  for (const int p : patch.points) {
    const double normal = scene.ground.normal.dot(impulse.col(p));
    load.speed += normal * level_velocity(scene, state, p).norm();
    load.normal_impulse += normal;
  }
  load.speed = load.normal_impulse > 0 ? load.speed / load.normal_impulse : 0;
  return load;
}

double patch_height(const physics::Scene& scene, const Patch& patch, const physics::State& state) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const int p : patch.points) lowest = std::min(lowest, height_above_ground(scene, state, p));
  return lowest;
}

}  // namespace hydrostat::retarget

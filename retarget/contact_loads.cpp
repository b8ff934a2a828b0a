#include "retarget/contact_loads.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kPointLoad = 1e-6, kPatchLoad = 0.01;  // [m g]
constexpr double kStillSpeed = 0.01;                    // of sqrt(g L): a loaded patch that moves faster slides

/// Velocity of a contact point along the ground.
Eigen::Vector3d level_velocity(const physics::Scene& scene, const physics::State& state, int point) {
  const Eigen::Vector3d velocity = scene.contact_points.of(state.v, point);
  return velocity - scene.ground.normal.dot(velocity) * scene.ground.normal;
}

}  // namespace

ContactThresholds contact_thresholds(const physics::Scene& scene, double length, double seconds) {
  const double weight = scene.body.mass.sum() * scene.gravity.norm(), wave_speed = std::sqrt(scene.gravity.norm() * length);
  return {kPointLoad * weight * seconds, kPatchLoad * weight * seconds, kStillSpeed * wave_speed};
}

double height_above_ground(const physics::Scene& scene, const physics::State& state, int point) {
  return scene.ground.normal.dot(scene.contact_points.of(state.x, point)) - scene.ground.offset;
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
  Eigen::Vector3d moving = Eigen::Vector3d::Zero();
  for (const int p : patch.points) {
    const double normal = scene.ground.normal.dot(impulse.col(p));
    moving += normal * level_velocity(scene, state, p);
    load.normal_impulse += normal;
    load.gap = std::min(load.gap, height_above_ground(scene, state, p));
  }
  if (load.normal_impulse > 0) load.speed = moving.norm() / load.normal_impulse;
  return load;
}

}  // namespace hydrostat::retarget

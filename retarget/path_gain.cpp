#include "retarget/path_gain.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kCrawlingEffort = 20;  // times as much

/// It bears itself by its trunk alone, and that slides.
bool crawls(const ContactSchedule& contacts) {
  return is_dragged(contacts) && std::none_of(contacts.patches.begin(), contacts.patches.end(), [](const Patch& patch) { return patch.on_leg; });
}

/// How far momentum and spin of the path are from the target's, with the error of place that they are to make up for, in speeds per
/// sqrt(g L): the corrector's error of momentum there. f is a sample of the path.
double momentum_error(const ReplayInput& input, const MotionCurve& target, double settle_s, Eigen::Index f) {
  const physics::Body& body = input.model.body;
  const Motion& place = input.path->place;
  physics::State state;
  target.at(static_cast<double>(f) / place.rate_hz, state.x, state.v);
  state.v = place.at(f) / settle_s + input.path->velocity.at(f);
  const double mass = body.mass.sum();
  const Eigen::Vector3d com = physics::centre_of_mass(body, state.x), momentum = state.v * body.mass;
  const Eigen::Matrix3d inertia = physics::inertia(body, state.x, com);
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();
  for (int i = 0; i < body.node_count(); ++i) {
    spin += body.mass[i] * (state.x.col(i) - com).cross(Eigen::Vector3d(state.v.col(i)));
  }
  const double gyration = std::sqrt(inertia.trace() / 2 / mass);
  return std::hypot(momentum.norm() / mass, gyration * (inertia.inverse() * spin).norm()) /
         std::sqrt(input.scene.gravity.norm() * input.length);
}

}  // namespace

CorrectorOptions gain_on_path(const ReplayInput& input, const CorrectorOptions& options) {
  CorrectorOptions result = options;
  if (crawls(input.prepared.contacts)) result.effort *= kCrawlingEffort;
  if (!input.path || input.path->is_empty() || input.scene.gravity.isZero(0)) return result;
  const MotionCurve target(input.prepared.target);
  const Eigen::Index samples = input.path->place.count();
  double kept = 0;
  for (Eigen::Index f = 0; f < samples; ++f) {
    const double error = momentum_error(input, target, result.settle_s, f) / result.calm_error;
    kept += 1 / (1 + error * error) / static_cast<double>(samples);
  }
  result.calm *= kept;
  if (kept < 0.5) result.response_every = 1;  // as it was with an error beyond calm_error
  return result;
}

}  // namespace hydrostat::retarget

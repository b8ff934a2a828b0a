#include "retarget/nominal_path.h"

namespace hydrostat::retarget {
namespace {

/// A curve wants a frame; an empty path has none.
Motion or_nothing(const Motion& motion) {
  if (motion.count() > 0) return motion;
  Motion none;
  none.frames.setZero(0, 1);
  return none;
}

}  // namespace

NominalPathCurve::NominalPathCurve(const NominalPath& path)
    : is_empty_(path.is_empty()), place_(or_nothing(path.place)), velocity_(or_nothing(path.velocity)) {}

void NominalPathCurve::apply(double time_s, physics::State& reference) {
  if (is_empty_) return;
  place_.at(time_s, offset_, slope_);
  reference.x += offset_;
  velocity_.at(time_s, offset_, slope_);
  reference.v += offset_;
}

void Lesson::make_room(Eigen::Index activations, Eigen::Index coordinates, Eigen::Index steps) {
  time_s.setZero(steps);
  added.setZero(activations, steps);
  place.setZero(coordinates, steps);
  velocity.setZero(coordinates, steps);
}

void Lesson::cut(Eigen::Index steps) {
  time_s.conservativeResize(steps);
  added.conservativeResize(Eigen::NoChange, steps);
  place.conservativeResize(Eigen::NoChange, steps);
  velocity.conservativeResize(Eigen::NoChange, steps);
}

}  // namespace hydrostat::retarget

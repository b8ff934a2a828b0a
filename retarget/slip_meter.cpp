#include "retarget/slip_meter.h"

#include <limits>

namespace hydrostat::retarget {
namespace {

constexpr double kLeastGap = 1.0 / 15;  // [s]

}  // namespace

SlipMeter::SlipMeter(const physics::Scene& scene, const PreparedTarget& prepared, double length, double step_s)
    : scene_(scene), prepared_(prepared), step_s_(step_s), least_impulse_(contact_thresholds(scene, length, step_s).patch_impulse) {
  for (Stances* stances : {&all_, &held_}) {
    stances->loaded_until_s.assign(prepared.contacts.patches.size(), -std::numeric_limits<double>::infinity());
  }
}

void SlipMeter::add(double time_s, const physics::State& state, const Eigen::Matrix3Xd& impulse) {
  const ContactSchedule& plan = prepared_.contacts;
  const auto frame = static_cast<std::size_t>(frame_at(prepared_.target, time_s));
  for (std::size_t k = 0; k < plan.patches.size(); ++k) {
    const PatchLoad load = patch_load(scene_, plan.patches[k], state, impulse);
    if (load.normal_impulse <= least_impulse_) continue;
    all_.add(k, time_s, step_s_, load.speed);
    if (plan.state[k][frame] == ContactState::kStick) held_.add(k, time_s, step_s_, load.speed);
  }
}

void SlipMeter::Stances::add(std::size_t patch, double time_s, double step_s, double speed) {
  if (time_s - step_s - loaded_until_s[patch] > kLeastGap) ++count;
  loaded_until_s[patch] = time_s;
  way += speed * step_s;
}

}  // namespace hydrostat::retarget

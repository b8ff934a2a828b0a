#include "retarget/cost_source.h"

namespace hydrostat::retarget {

std::shared_ptr<const CostToGo> CostSource::cost(double control_s, RegulatorOptions options) const {
  options.reach = 0;  // whatever is found cannot hang on it
  const std::lock_guard lock(mutex_);
  if (!cost_ || control_s != control_s_ || options != options_) {
    cost_.reset();  // first, for it is large
    cost_ = std::make_shared<const CostToGo>(find_cost_to_go(motion_, control_s, options));
    control_s_ = control_s;
    options_ = options;
    ++times_found_;
  }
  return cost_->is_sound() ? cost_ : nullptr;
}

bool CostSource::is_of(const physics::Scene& scene, const Muscles& muscles, const PreparedTarget& prepared, const NominalPath* path) const {
  return &scene == &motion_.scene && &muscles == &motion_.muscles && &prepared == &motion_.prepared && path == &motion_.path;
}

int CostSource::times_found() const {
  const std::lock_guard lock(mutex_);
  return times_found_;
}

}  // namespace hydrostat::retarget

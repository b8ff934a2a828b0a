#include "retarget/observer.h"

#include <cmath>

namespace hydrostat::retarget {

Observer::Observer(const Observation& observation, double control_s)
    : observation_(observation),
      control_s_(control_s),
      delay_steps_(std::lround(observation.delay_s / control_s)),
      generator_(observation.seed) {}

/// The standard library's normal distribution is another one on every platform; the sum of twelve even ones is the same.
void Observer::draw(Eigen::Matrix3Xd& noise, Eigen::Index nodes) {
  noise.resize(3, nodes);
  for (Eigen::Index k = 0; k < noise.size(); ++k) {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += std::ldexp(static_cast<double>(generator_() >> 11), -53);
    noise(k) = observation_.noise_m * sum;
  }
}

const physics::State& Observer::see(const physics::State& state) {
  past_.push_back(state);
  if (static_cast<long>(past_.size()) > delay_steps_ + 1) past_.pop_front();
  seen_ = past_.front();
  if (observation_.noise_m == 0) return seen_;
  draw(noise_, state.x.cols());
  seen_.x += noise_;
  if (before_.size() == 0) before_ = seen_.x;
  seen_.v = (seen_.x - before_) / control_s_;
  before_ = seen_.x;
  return seen_;
}

}  // namespace hydrostat::retarget

#include "retarget/observer.h"

#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kDrawEvery = 0.1;  // [s]

}  // namespace

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
  const Eigen::Index nodes = state.x.cols();
  if (to_.size() == 0) draw(to_, nodes);
  if (share_ >= 1) {
    from_ = to_;
    draw(to_, nodes);
    share_ -= 1;
  }
  // From draw to draw along a half cosine, whose mean square over the way is 3/4 of a draw's: made up for.
  const double scale = std::sqrt(4.0 / 3);
  const double angle = M_PI * share_, s = scale * (1 - std::cos(angle)) / 2;
  seen_.x += (scale - s) * from_ + s * to_;
  seen_.v += (scale * M_PI / 2 / kDrawEvery * std::sin(angle)) * (to_ - from_);
  share_ += control_s_ / kDrawEvery;
  return seen_;
}

}  // namespace hydrostat::retarget

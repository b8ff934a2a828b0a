#include "signal/synthesiser.h"

#include <algorithm>
#include <cassert>

namespace hydrostat::signal {

Synthesiser::Synthesiser(const Spectrum& spectrum, double period_s, double low, double high)
    : basis_(basis_of(spectrum)),
      coefficients_(stacked_coefficients(spectrum).transpose()),
      basis_values_(basis_.size()),
      period_s_(period_s),
      low_(low),
      high_(high) {
  assert(period_s > 0 && low <= high);
}

Eigen::Index Synthesiser::at(double time_s, Eigen::Ref<Eigen::VectorXd> values) {
  assert(values.size() == channels());
  basis_.fill_values(time_s / period_s_, basis_values_);
  values.noalias() = coefficients_ * basis_values_;
  return clip_to_limits(values, low_, high_);
}

Eigen::Index clip_to_limits(Eigen::Ref<Eigen::MatrixXd> samples, double low, double high) {
  assert(low <= high);
  Eigen::Index clipped = 0;
  for (Eigen::Index c = 0; c < samples.cols(); ++c) {
    for (Eigen::Index j = 0; j < samples.rows(); ++j) {
      const double held = std::clamp(samples(j, c), low, high);
      if (held != samples(j, c)) ++clipped;
      samples(j, c) = held;
    }
  }
  return clipped;
}

}  // namespace hydrostat::signal

#include "signal/high_pass.h"

#include <cmath>

namespace hydrostat::signal {

HighPass::HighPass(double cutoff_hz, double rate_hz, Eigen::Index signals) : out_(Eigen::VectorXd::Zero(signals)) {
  const double w = 2 * M_PI * cutoff_hz / rate_hz;
  for (int k = 0; k < 2; ++k) {
    // Pole pairs of the fourth order lie at pi / 8 and 3 pi / 8 from the axis: 1 / Q = 2 cos of that.
    const double damping = std::sin(w) * std::cos((2 * k + 1) * M_PI / 8);
    const double unit = 1 + damping, pass = (1 + std::cos(w)) / 2;
    sections_[static_cast<std::size_t>(k)] = {pass / unit,
                                              -2 * pass / unit,
                                              pass / unit,
                                              -2 * std::cos(w) / unit,
                                              (1 - damping) / unit,
                                              Eigen::VectorXd::Zero(signals),
                                              Eigen::VectorXd::Zero(signals)};
  }
}

const Eigen::VectorXd& HighPass::next(const Eigen::VectorXd& sample) {
  out_ = sample;
  for (Section& s : sections_) {
    for (Eigen::Index i = 0; i < out_.size(); ++i) {
      const double in = out_[i], out = s.b0 * in + s.first[i];
      s.first[i] = s.b1 * in - s.a1 * out + s.second[i];
      s.second[i] = s.b2 * in - s.a2 * out;
      out_[i] = out;
    }
  }
  return out_;
}

}  // namespace hydrostat::signal

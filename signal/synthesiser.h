#pragma once

#include <Eigen/Core>

#include "signal/spectrum.h"

namespace hydrostat::signal {

/// Plays a spectrum over time, held within limits. What a step loop asks for at every step is laid out beforehand: a call
/// costs about C x 2 (K + 1) multiply-adds and allocates nothing. One per thread: a call writes to the scratch memory
/// inside.
class Synthesiser {
 public:
  /// period_s [s] > 0: of a loop, or from the first to the last sample of a one-shot. Values stay within [low, high].
  Synthesiser(const Spectrum& spectrum, double period_s, double low, double high);

  Eigen::Index channels() const { return coefficients_.rows(); }
  double period_s() const { return period_s_; }

  /// Values (C) at a time [s]: a loop repeats, a one-shot holds its end values. Returns how many were held at a limit.
  Eigen::Index at(double time_s, Eigen::Ref<Eigen::VectorXd> values);

 private:
  Basis basis_;
  Eigen::MatrixXd coefficients_;  // C x R: a row of the basis touches one contiguous column
  Eigen::VectorXd basis_values_;  // R
  double period_s_;
  double low_;
  double high_;
};

/// Holds every sample within [low, high] and returns how many were outside.
Eigen::Index clip_to_limits(Eigen::Ref<Eigen::MatrixXd> samples, double low, double high);

}  // namespace hydrostat::signal

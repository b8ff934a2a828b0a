#pragma once

#include <Eigen/Core>
#include <array>

namespace hydrostat::signal {

/// What is faster than a frequency in many signals at once: a Butterworth filter of fourth order, 3 dB down at cutoff_hz [Hz] and
/// 24 dB an octave below. Samples come at rate_hz, more than twice the cut-off; before the first all was zero. Source: Butterworth, "On
/// the Theory of Filter Amplifiers", Experimental Wireless, 1930; two second-order sections by the bilinear transform.
class HighPass {
 public:
  HighPass(double cutoff_hz, double rate_hz, Eigen::Index signals);

  /// Takes a sample of each signal and returns the filtered one.
  const Eigen::VectorXd& next(const Eigen::VectorXd& sample);

 private:
  struct Section {
    double b0, b1, b2, a1, a2;
    Eigen::VectorXd first, second;  // what it remembers
  };
  std::array<Section, 2> sections_;
  Eigen::VectorXd out_;
};

}  // namespace hydrostat::signal

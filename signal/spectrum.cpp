#include "signal/spectrum.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "signal/transforms.h"

namespace hydrostat::signal {

namespace {

constexpr double kPi = std::numbers::pi;

/// What a harmonic keeps of itself under truncation to `kept` harmonics.
double truncation_weight(int harmonic, int kept, int roll_off) {
  if (harmonic > kept) return 0;
  const int into_roll_off = harmonic - (kept - roll_off);
  if (into_roll_off <= 0 || harmonic == 0) return 1;
  return 0.5 * (1 + std::cos(kPi * into_roll_off / (roll_off + 1)));
}

/// Mean square of one harmonic over the samples, summed over channels.
double harmonic_energy(const Spectrum& spectrum, int harmonic) {
  const double cosine = spectrum.cosine.row(harmonic).squaredNorm();
  if (harmonic == 0) return cosine;
  if (spectrum.kind == Kind::one_shot) return 0.5 * cosine;
  const double sine = spectrum.sine.row(harmonic).squaredNorm();
  const bool is_nyquist = 2 * harmonic == spectrum.samples;
  return is_nyquist ? cosine : 0.5 * (cosine + sine);
}

/// Powers 0..3 of the phase, 4 x C, through the end values with the end slopes (Hermite's cubic).
Eigen::MatrixXd end_cubic(const Eigen::Ref<const Eigen::MatrixXd>& samples) {
  const Eigen::Index last = samples.rows() - 1;
  const double per_phase = static_cast<double>(last) / 6;
  const Eigen::RowVectorXd start_slope =
      per_phase * (-11 * samples.row(0) + 18 * samples.row(1) - 9 * samples.row(2) + 2 * samples.row(3));
  const Eigen::RowVectorXd end_slope = per_phase * (11 * samples.row(last) - 18 * samples.row(last - 1) +
                                                    9 * samples.row(last - 2) - 2 * samples.row(last - 3));
  const Eigen::RowVectorXd rise = samples.row(last) - samples.row(0);
  Eigen::MatrixXd cubic(4, samples.cols());
  cubic.row(0) = samples.row(0);
  cubic.row(1) = start_slope;
  cubic.row(2) = 3 * rise - 2 * start_slope - end_slope;
  cubic.row(3) = start_slope + end_slope - 2 * rise;
  return cubic;
}

Eigen::MatrixXd sampled_cubic(const Eigen::MatrixXd& cubic, Eigen::Index n) {
  const Eigen::ArrayXd phase = Eigen::ArrayXd::LinSpaced(n, 0, 1);
  Eigen::MatrixXd powers(n, 4);
  powers << Eigen::VectorXd::Ones(n), phase.matrix(), phase.square().matrix(), phase.cube().matrix();
  return powers * cubic;
}

}  // namespace

int max_harmonics(Kind kind, int n) { return kind == Kind::loop ? n / 2 : n - 1; }

Spectrum analyse_loop(const Eigen::Ref<const Eigen::MatrixXd>& samples, int harmonics, int roll_off) {
  const int n = static_cast<int>(samples.rows());
  assert(n >= 2 && harmonics >= 0 && harmonics <= max_harmonics(Kind::loop, n));
  const Eigen::MatrixXd transform = real_fourier_transform(samples);
  const int complete = max_harmonics(Kind::loop, n);
  Spectrum spectrum{Kind::loop, n, Eigen::MatrixXd::Zero(complete + 1, samples.cols()),
                    Eigen::MatrixXd::Zero(complete + 1, samples.cols()), Eigen::MatrixXd(0, samples.cols())};
  spectrum.cosine.row(0) = transform.row(0) / n;
  for (int k = 1; k <= complete; ++k) {
    if (2 * k == n) {
      spectrum.cosine.row(k) = transform.row(k) / n;
    } else {
      spectrum.cosine.row(k) = transform.row(k) * (2.0 / n);
      spectrum.sine.row(k) = transform.row(n - k) * (-2.0 / n);
    }
  }
  return truncated(spectrum, harmonics, roll_off);
}

Spectrum analyse_one_shot(const Eigen::Ref<const Eigen::MatrixXd>& samples, int harmonics, int roll_off) {
  const int n = static_cast<int>(samples.rows());
  assert(n >= 4 && harmonics >= 0 && harmonics <= max_harmonics(Kind::one_shot, n));
  Spectrum spectrum{Kind::one_shot, n, Eigen::MatrixXd(), Eigen::MatrixXd(0, samples.cols()), end_cubic(samples)};
  spectrum.cosine = cosine_transform(samples - sampled_cubic(spectrum.cubic, n)) / n;
  spectrum.cosine.row(0) *= 0.5;
  return truncated(spectrum, harmonics, roll_off);
}

Spectrum analyse(Kind kind, const Eigen::Ref<const Eigen::MatrixXd>& samples, int harmonics, int roll_off) {
  return kind == Kind::loop ? analyse_loop(samples, harmonics, roll_off) : analyse_one_shot(samples, harmonics, roll_off);
}

Spectrum truncated(const Spectrum& spectrum, int harmonics, int roll_off) {
  assert(harmonics >= 0 && roll_off >= 0);
  Spectrum result = spectrum;
  const int common = std::min(harmonics, spectrum.harmonics());
  const int fading = harmonics < spectrum.harmonics() ? roll_off : 0;
  result.cosine = Eigen::MatrixXd::Zero(harmonics + 1, spectrum.channels());
  if (spectrum.kind == Kind::loop) result.sine = result.cosine;
  for (int k = 0; k <= common; ++k) {
    const double weight = truncation_weight(k, harmonics, fading);
    result.cosine.row(k) = weight * spectrum.cosine.row(k);
    if (spectrum.kind == Kind::loop) result.sine.row(k) = weight * spectrum.sine.row(k);
  }
  return result;
}

int choose_harmonics(const Spectrum& complete, double target_rms, int roll_off) {
  const int most = max_harmonics(complete.kind, complete.samples);
  assert(complete.harmonics() == most);
  if (complete.channels() == 0) return std::min(4, most);
  Eigen::VectorXd energy(most + 1);
  for (int k = 0; k <= most; ++k) energy[k] = harmonic_energy(complete, k);
  const double allowed = target_rms * target_rms * static_cast<double>(complete.channels());
  for (int kept = std::min(4, most); kept < most; ++kept) {
    double lost = 0;
    for (int k = most; k > 0; --k) {
      const double missing = 1 - truncation_weight(k, kept, roll_off);
      lost += missing * missing * energy[k];
    }
    if (lost <= allowed) return kept;
  }
  return most;
}

int choose_harmonics(Kind kind, const Eigen::Ref<const Eigen::MatrixXd>& samples, double target_rms, int roll_off) {
  const int most = max_harmonics(kind, static_cast<int>(samples.rows()));
  return choose_harmonics(analyse(kind, samples, most), target_rms, roll_off);
}

Eigen::VectorXd synthesise(const Spectrum& spectrum, double phase) {
  const Basis basis = basis_of(spectrum);
  Eigen::VectorXd values(basis.size());
  basis.fill_values(phase, values);
  return stacked_coefficients(spectrum).transpose() * values;
}

Eigen::VectorXd synthesise_slope(const Spectrum& spectrum, double phase) {
  const Basis basis = basis_of(spectrum);
  Eigen::VectorXd slopes(basis.size());
  basis.fill_slopes(phase, slopes);
  return stacked_coefficients(spectrum).transpose() * slopes;
}

Eigen::MatrixXd synthesise_samples(const Spectrum& spectrum, int n) {
  assert(n >= 2);
  const Basis basis = basis_of(spectrum);
  const double steps = spectrum.kind == Kind::loop ? n : n - 1;
  Eigen::MatrixXd values(basis.size(), n);
  for (int j = 0; j < n; ++j) basis.fill_values(j / steps, values.col(j));
  return values.transpose() * stacked_coefficients(spectrum);
}

double rms_difference(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b) {
  assert(a.rows() == b.rows() && a.cols() == b.cols());
  return a.size() == 0 ? 0 : std::sqrt((a - b).squaredNorm() / static_cast<double>(a.size()));
}

double spread_closure_defect(Eigen::Ref<Eigen::MatrixXd> samples) {
  assert(samples.rows() >= 2);
  const Eigen::Index n = samples.rows() - 1;
  const Eigen::RowVectorXd defect = samples.row(n) - samples.row(0);
  for (Eigen::Index j = 0; j <= n; ++j) {
    const double s = static_cast<double>(j) / static_cast<double>(n);
    samples.row(j) -= (s * s * (3 - 2 * s) - 0.5) * defect;
  }
  samples.row(n) = samples.row(0);
  return defect.size() == 0 ? 0 : defect.cwiseAbs().maxCoeff();
}

void Basis::fill_values(double phase, Eigen::Ref<Eigen::VectorXd> values) const {
  assert(values.size() == size());
  if (kind == Kind::loop) {
    const double turn = 2 * kPi * (phase - std::floor(phase));
    for (int k = 0; k <= harmonics; ++k) {
      values[k] = std::cos(turn * k);
      values[harmonics + 1 + k] = std::sin(turn * k);
    }
    return;
  }
  const double held = std::clamp(phase, 0.0, 1.0);
  const double turn = kPi * (held * (samples - 1) + 0.5) / samples;
  for (int k = 0; k <= harmonics; ++k) values[k] = std::cos(turn * k);
  values[harmonics + 1] = 1;
  for (int power = 1; power <= 3; ++power) values[harmonics + 1 + power] = held * values[harmonics + power];
}

void Basis::fill_slopes(double phase, Eigen::Ref<Eigen::VectorXd> slopes) const {
  assert(slopes.size() == size());
  if (kind == Kind::loop) {
    const double turn = 2 * kPi * (phase - std::floor(phase));
    for (int k = 0; k <= harmonics; ++k) {
      slopes[k] = -2 * kPi * k * std::sin(turn * k);
      slopes[harmonics + 1 + k] = 2 * kPi * k * std::cos(turn * k);
    }
    return;
  }
  if (phase < 0 || phase > 1) {
    slopes.setZero();
    return;
  }
  const double turn = kPi * (phase * (samples - 1) + 0.5) / samples;
  const double turn_per_phase = kPi * (samples - 1) / samples;
  for (int k = 0; k <= harmonics; ++k) slopes[k] = -turn_per_phase * k * std::sin(turn * k);
  slopes.tail<4>() << 0, 1, 2 * phase, 3 * phase * phase;
}

Basis basis_of(const Spectrum& spectrum) { return {spectrum.kind, spectrum.samples, spectrum.harmonics()}; }

Eigen::MatrixXd stacked_coefficients(const Spectrum& spectrum) {
  Eigen::MatrixXd stacked(basis_of(spectrum).size(), spectrum.channels());
  stacked << spectrum.cosine, (spectrum.kind == Kind::loop ? spectrum.sine : spectrum.cubic);
  return stacked;
}

}  // namespace hydrostat::signal

#pragma once

#include <Eigen/Core>

namespace hydrostat::signal {

/// A loop repeats; a one-shot starts, ends and holds its end values outside.
enum class Kind { loop, one_shot };

/// Coefficients of C channels, scaled so that their sum is the signal; harmonic 0 is the mean.
///   loop:      value(phase) = sum over k of cosine(k) cos(2 pi k phase) + sine(k) sin(2 pi k phase), phase in periods
///   one-shot:  value(phase) = cubic(phase) + sum over k of cosine(k) cos(pi k x), phase 0 at the first sample, 1 at the
///   last,
///              x = (phase (n - 1) + 1/2) / n: the grid of the DCT-II. The cubic counts as part of harmonic 0.
struct Spectrum {
  Kind kind = Kind::loop;
  int samples = 0;         // n that were analysed
  Eigen::MatrixXd cosine;  // (K + 1) x C
  Eigen::MatrixXd sine;    // loop: (K + 1) x C, row 0 is 0; one-shot: 0 x C
  Eigen::MatrixXd cubic;   // one-shot: 4 x C, powers 0 to 3 of the phase; loop: 0 x C

  int harmonics() const { return static_cast<int>(cosine.rows()) - 1; }
  Eigen::Index channels() const { return cosine.cols(); }
};

/// Highest harmonic that n samples tell: n / 2 of a loop, n - 1 of a one-shot.
int max_harmonics(Kind kind, int n);

/// Coefficients 0..harmonics of one exact period, samples n x C (n >= 2) without the repeated last, no window.
/// harmonics is in [0, max_harmonics]; there the samples come back exactly. roll_off: see truncated().
Spectrum analyse_loop(const Eigen::Ref<const Eigen::MatrixXd>& samples, int harmonics, int roll_off = 0);

/// Coefficients of a motion from rest to rest or from one thing to another, samples n x C (n >= 4) with both ends: the cubic
/// through the end values and end slopes (one-sided differences of third order), and the DCT-II of what is left.
Spectrum analyse_one_shot(const Eigen::Ref<const Eigen::MatrixXd>& samples, int harmonics, int roll_off = 0);

/// One of the two above.
Spectrum analyse(Kind kind, const Eigen::Ref<const Eigen::MatrixXd>& samples, int harmonics, int roll_off = 0);

/// The spectrum cut, or filled up with zeros, to the given harmonics. A cut rings at sharp events, so the last `roll_off`
/// harmonics that stay fade by a raised cosine; where nothing is cut, nothing fades.
Spectrum truncated(const Spectrum& spectrum, int harmonics, int roll_off = 0);

/// Fewest harmonics whose RMS error over all channels and samples is at most target_rms [unit of the signal], at least 4, at
/// most max_harmonics. `complete` has all harmonics of its samples; the errors follow from it by Parseval's theorem.
int choose_harmonics(const Spectrum& complete, double target_rms, int roll_off = 0);
int choose_harmonics(Kind kind, const Eigen::Ref<const Eigen::MatrixXd>& samples, double target_rms, int roll_off = 0);

/// Values (C) at a phase. Loops take any phase; one-shots hold their end values outside [0, 1].
Eigen::VectorXd synthesise(const Spectrum& spectrum, double phase);

/// Derivative by phase (C) [unit per period, or per duration]; 0 outside a one-shot.
Eigen::VectorXd synthesise_slope(const Spectrum& spectrum, double phase);

/// Values at n uniform phases, n x C: j / n of a loop, j / (n - 1) of a one-shot (n >= 2).
Eigen::MatrixXd synthesise_samples(const Spectrum& spectrum, int n);

/// Root mean square of all entries of a - b; 0 where they are empty.
double rms_difference(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b);

/// Makes samples ((n + 1) x C, the last row repeats the first) periodic: spreads the difference between last and first row
/// over the period by a smooth ramp that has no slope at the ends, half of it to either end. Returns the largest difference
/// of a channel [unit of the signal] as it was; whether that still is a loop, the caller decides.
double spread_closure_defect(Eigen::Ref<Eigen::MatrixXd> samples);

/// The functions that the coefficients of a spectrum multiply, one row each: cosines 0..K, then sines 0..K of a loop or the
/// powers 0..3 of a one-shot.
struct Basis {
  Kind kind = Kind::loop;
  int samples = 0;
  int harmonics = 0;

  Eigen::Index size() const { return kind == Kind::loop ? 2 * (harmonics + 1) : harmonics + 5; }
  /// Fills `values` (size()) at a phase; allocates nothing.
  void fill_values(double phase, Eigen::Ref<Eigen::VectorXd> values) const;
  /// Their derivatives by phase.
  void fill_slopes(double phase, Eigen::Ref<Eigen::VectorXd> slopes) const;
};

Basis basis_of(const Spectrum& spectrum);

/// The coefficients in the order of the basis, size() x C.
Eigen::MatrixXd stacked_coefficients(const Spectrum& spectrum);

}  // namespace hydrostat::signal

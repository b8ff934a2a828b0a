#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "signal/layers.h"
#include "signal/spectrum.h"
#include "signal/synthesiser.h"

namespace hydrostat::retarget {

/// Activation of a muscle at rest: its rest length is that of the bind pose.
constexpr double kPassiveActivation = 1;

/// The coefficients that drive a body, one channel per constraint, and what a person did to them.
struct SignalSet {
  double period_s = 0;                  // of a loop, or from the first to the last sample of a one-shot
  double limit = 0;                     // activations stay within 1 - limit and 1 + limit, in (0, 1)
  std::vector<signal::Label> channels;  // E; name "edge/<i>-<j>", group: the bone region that owns the edge
  Eigen::Matrix2Xi nodes;               // 2 x E
  Eigen::VectorXd rest_length;          // [m] E, > 0
  Eigen::VectorXd stiffness;            // [N/m] E, >= 0
  signal::Spectrum activation;          // [-] E channels, as solved
  signal::Spectrum force;               // [N] E channels: the penalty forces that go with them
  std::vector<signal::Layer> layers;    // edits of the activations, in order

  int count() const { return static_cast<int>(channels.size()); }
  signal::Kind kind() const { return activation.kind; }
  int samples() const { return activation.samples; }
  /// Of the analysed samples [Hz]: n / period of a loop, (n - 1) / duration of a one-shot.
  double rate_hz() const { return (kind() == signal::Kind::loop ? samples() : samples() - 1) / period_s; }
};

/// What the inverse dynamics found, one column per constraint.
struct SolvedSignals {
  signal::Kind kind = signal::Kind::loop;
  double period_s = 0;             // as in SignalSet
  double limit = 0;                // as in SignalSet
  Eigen::MatrixXd activation;      // [-] F x E; a loop without its repeated last frame
  Eigen::MatrixXd force;           // [N] F x E, see penalty_forces
  std::vector<std::string> bones;  // E; bone region that owns the edge
  Eigen::Matrix2Xi nodes;          // 2 x E
  Eigen::VectorXd rest_length;     // [m] E
  Eigen::VectorXd stiffness;       // [N/m] E
};

struct SignalOptions {
  double target_rms = 0.001;  // [-] RMS error of the activations that the cut may leave: per rest length, as they are
  int harmonics = 0;          // 0: as few as meet the target
  int roll_off = 1;           // last harmonics that fade, so that the cut does not ring
};

/// Says which option breaks which rule for F samples of a kind; empty when all is well.
std::string broken_rule(const SignalOptions& options, signal::Kind kind, int samples);

/// Force that pulls the ends of a constraint together: k (l - a l0) [N], F x E, from activations [-] F x E, lengths [m] F x
/// E, rest lengths [m] E and stiffnesses [N/m] E.
Eigen::MatrixXd penalty_forces(const Eigen::Ref<const Eigen::MatrixXd>& activation,
                               const Eigen::Ref<const Eigen::MatrixXd>& lengths,
                               const Eigen::Ref<const Eigen::VectorXd>& rest_length,
                               const Eigen::Ref<const Eigen::VectorXd>& stiffness);

/// Analyses activations and forces with the harmonics that the activations need. No layers.
SignalSet analyse_signals(const SolvedSignals& solved, const SignalOptions& options);

/// RMS of solved coefficients, before any layer, against the samples that they came from [-].
double activation_error_rms(const SignalSet& set, const Eigen::Ref<const Eigen::MatrixXd>& samples);

/// Gives the layers of an earlier solution to a new one. Returns one sentence per layer that was left out, because it breaks
/// a rule there, or that no longer touches any channel.
std::vector<std::string> keep_layers(const SignalSet& earlier, SignalSet& set);

/// The activations with their layers, and what the limits do to them on the n samples.
struct EditedActivations {
  signal::Spectrum spectrum;        // before the limits
  std::vector<int> touched;         // channels that each layer touched
  Eigen::MatrixXd samples;          // [-] n x E, within the limits
  Eigen::Index clipped = 0;         // samples that a limit holds
  Eigen::Index solved_clipped = 0;  // the same without layers: what the cut to few harmonics overshoots
};
EditedActivations edited_activations(const SignalSet& set);

/// Plays the activations with their layers, within the limits.
signal::Synthesiser activations(const SignalSet& set);

/// The channels of one bone in a few numbers.
struct BoneSignals {
  struct Harmonic {
    int harmonic;
    double amplitude;  // RMS over the channels [-]
  };
  std::string bone;
  std::vector<int> channels;
  double mean = 0;                  // activation [-] over samples and channels
  double rms = 0;                   // deviation from each channel's mean [-]
  double lowest = 0, highest = 0;   // [-]
  std::vector<Harmonic> strongest;  // up to three, strongest first
};

/// Groups the chosen channels by bone, in the order in which the bones first appear.
std::vector<BoneSignals> signals_by_bone(const SignalSet& set, const EditedActivations& edited,
                                         const std::vector<int>& channels);

}  // namespace hydrostat::retarget

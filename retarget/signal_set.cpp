#include "retarget/signal_set.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace hydrostat::retarget {

namespace {

constexpr int kStrongestShown = 3;

/// RMS over some channels of the amplitude of harmonic k [-].
double harmonic_amplitude(const signal::Spectrum& spectrum, const std::vector<int>& channels, int k) {
  double sum = 0;
  for (const int c : channels) {
    sum += spectrum.cosine(k, c) * spectrum.cosine(k, c);
    if (spectrum.kind == signal::Kind::loop) sum += spectrum.sine(k, c) * spectrum.sine(k, c);
  }
  return std::sqrt(sum / static_cast<double>(channels.size()));
}

std::vector<BoneSignals::Harmonic> strongest_harmonics(const signal::Spectrum& spectrum, const std::vector<int>& channels) {
  std::vector<BoneSignals::Harmonic> harmonics;
  for (int k = 1; k <= spectrum.harmonics(); ++k) harmonics.push_back({k, harmonic_amplitude(spectrum, channels, k)});
  std::stable_sort(harmonics.begin(), harmonics.end(),
                   [](const auto& a, const auto& b) { return a.amplitude > b.amplitude; });
  if (harmonics.size() > kStrongestShown) harmonics.resize(kStrongestShown);
  return harmonics;
}

void fill_figures(const EditedActivations& edited, BoneSignals& bone) {
  const Eigen::MatrixXd samples = edited.samples(Eigen::all, bone.channels);
  bone.mean = samples.mean();
  bone.rms = std::sqrt((samples.rowwise() - samples.colwise().mean()).squaredNorm() / static_cast<double>(samples.size()));
  bone.lowest = samples.minCoeff();
  bone.highest = samples.maxCoeff();
  bone.strongest = strongest_harmonics(edited.spectrum, bone.channels);
}

}  // namespace

std::string broken_rule(const SignalOptions& options, signal::Kind kind, int samples) {
  const int fewest = kind == signal::Kind::loop ? 2 : 4;
  if (samples < fewest) return std::to_string(samples) + " samples are fewer than the " + std::to_string(fewest) + " needed";
  if (!(options.target_rms >= 0)) return "target error is not 0 or above";
  const int most = signal::max_harmonics(kind, samples);
  if (options.harmonics < 0 || options.harmonics > most) {
    return "harmonics are not in 0 to " + std::to_string(most) + ", which " + std::to_string(samples) + " samples allow";
  }
  if (options.roll_off < 0) return "roll-off is below 0";
  return "";
}

Eigen::MatrixXd penalty_forces(const Eigen::Ref<const Eigen::MatrixXd>& activation,
                               const Eigen::Ref<const Eigen::MatrixXd>& lengths,
                               const Eigen::Ref<const Eigen::VectorXd>& rest_length,
                               const Eigen::Ref<const Eigen::VectorXd>& stiffness) {
  return (lengths - activation * rest_length.asDiagonal()) * stiffness.asDiagonal();
}

SignalSet analyse_signals(const SolvedSignals& solved, const SignalOptions& options) {
  const int n = static_cast<int>(solved.activation.rows());
  const Eigen::Index count = solved.activation.cols();
  assert(broken_rule(options, solved.kind, n).empty());
  assert(solved.force.rows() == n && solved.force.cols() == count && solved.nodes.cols() == count);
  assert(solved.rest_length.size() == count && solved.stiffness.size() == count);
  assert(static_cast<Eigen::Index>(solved.bones.size()) == count);
  const int most = signal::max_harmonics(solved.kind, n);
  const signal::Spectrum complete = signal::analyse(solved.kind, solved.activation, most);
  const int harmonics =
      options.harmonics > 0 ? options.harmonics : signal::choose_harmonics(complete, options.target_rms, options.roll_off);
  SignalSet set;
  set.period_s = solved.period_s;
  set.limit = solved.limit;
  for (Eigen::Index e = 0; e < count; ++e) {
    const std::string ends = std::to_string(solved.nodes(0, e)) + "-" + std::to_string(solved.nodes(1, e));
    set.channels.push_back({"edge/" + ends, solved.bones[static_cast<std::size_t>(e)]});
  }
  set.nodes = solved.nodes;
  set.rest_length = solved.rest_length;
  set.stiffness = solved.stiffness;
  set.activation = signal::truncated(complete, harmonics, options.roll_off);
  set.force = signal::analyse(solved.kind, solved.force, harmonics, options.roll_off);
  return set;
}

double activation_error_rms(const SignalSet& set, const Eigen::Ref<const Eigen::MatrixXd>& samples) {
  return signal::rms_difference(signal::synthesise_samples(set.activation, static_cast<int>(samples.rows())), samples);
}

std::vector<std::string> keep_layers(const SignalSet& earlier, SignalSet& set) {
  std::vector<std::string> told;
  for (const signal::Layer& layer : earlier.layers) {
    const std::string broken = signal::broken_rule(layer, set.kind(), set.samples());
    if (!broken.empty()) {
      told.push_back("layer '" + layer.name + "' was left out: " + broken);
      continue;
    }
    set.layers.push_back(layer);
    if (signal::selected_channels(layer.selection, set.channels).empty()) {
      told.push_back("layer '" + layer.name + "' no longer touches any channel");
    }
  }
  return told;
}

EditedActivations edited_activations(const SignalSet& set) {
  const double low = kPassiveActivation - set.limit;
  const double high = kPassiveActivation + set.limit;
  const signal::Edited edited = signal::apply(set.layers, set.activation, set.channels, kPassiveActivation);
  EditedActivations result;
  result.spectrum = edited.spectrum;
  result.touched = edited.touched;
  result.samples = signal::synthesise_samples(edited.spectrum, set.samples());
  result.clipped = signal::clip_to_limits(result.samples, low, high);
  Eigen::MatrixXd solved = signal::synthesise_samples(set.activation, set.samples());
  result.solved_clipped = signal::clip_to_limits(solved, low, high);
  return result;
}

signal::Synthesiser activations(const SignalSet& set) {
  const signal::Edited edited = signal::apply(set.layers, set.activation, set.channels, kPassiveActivation);
  return {edited.spectrum, set.period_s, kPassiveActivation - set.limit, kPassiveActivation + set.limit};
}

std::vector<BoneSignals> signals_by_bone(const SignalSet& set, const EditedActivations& edited,
                                         const std::vector<int>& channels) {
  std::vector<BoneSignals> bones;
  for (const int c : channels) {
    const std::string& name = set.channels[static_cast<std::size_t>(c)].group;
    auto bone = std::find_if(bones.begin(), bones.end(), [&](const BoneSignals& known) { return known.bone == name; });
    if (bone == bones.end()) {
      bones.push_back({});
      bone = bones.end() - 1;
      bone->bone = name;
    }
    bone->channels.push_back(c);
  }
  for (BoneSignals& bone : bones) fill_figures(edited, bone);
  return bones;
}

}  // namespace hydrostat::retarget

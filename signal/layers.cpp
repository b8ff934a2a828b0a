#include "signal/layers.h"

#include <fnmatch.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace hydrostat::signal {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFade = 0.05;  // of the period, over which an edit of a range comes and goes; at most half the range

bool matches(const std::string& pattern, const std::string& text) { return fnmatch(pattern.c_str(), text.c_str(), 0) == 0; }

/// The band as it falls on harmonics 0..K.
Band band_within(const Selection& selection, int harmonics) {
  const Band band = selection.band.value_or(Band{0, harmonics});
  return {band.first, std::min(band.last, harmonics)};
}

bool contains(const Band& band, int harmonic) { return band.first <= harmonic && harmonic <= band.last; }

Spectrum some_channels(const Spectrum& spectrum, const std::vector<int>& channels) {
  Spectrum part = spectrum;
  part.cosine = spectrum.cosine(Eigen::all, channels);
  part.sine = spectrum.sine(Eigen::all, channels);
  part.cubic = spectrum.cubic(Eigen::all, channels);
  return part;
}

void put_channels(const Spectrum& part, const std::vector<int>& channels, Spectrum& spectrum) {
  if (part.harmonics() > spectrum.harmonics()) spectrum = truncated(spectrum, part.harmonics());
  const Spectrum fitted = truncated(part, spectrum.harmonics());
  spectrum.cosine(Eigen::all, channels) = fitted.cosine;
  spectrum.sine(Eigen::all, channels) = fitted.sine;
  spectrum.cubic(Eigen::all, channels) = fitted.cubic;
}

/// Mean of the samples of a one-shot's cubic, C.
Eigen::RowVectorXd cubic_mean(const Spectrum& spectrum) {
  Spectrum cubic_alone = spectrum;
  cubic_alone.cosine.setZero();
  return synthesise_samples(cubic_alone, spectrum.samples).colwise().mean();
}

Spectrum edited(const SetHarmonic& set, const Selection&, const Spectrum& before, double) {
  Spectrum after = truncated(before, std::max(before.harmonics(), set.harmonic));
  const int k = set.harmonic;
  if (before.kind == Kind::one_shot) {
    after.cosine.row(k).setConstant(set.amplitude);
    if (k == 0) after.cosine.row(0) -= cubic_mean(before);
    return after;
  }
  for (Eigen::Index c = 0; c < after.channels(); ++c) {
    const double present = k == 0 ? 0 : std::atan2(after.sine(k, c), after.cosine(k, c));
    const double phase = set.phase.value_or(present);
    after.cosine(k, c) = set.amplitude * std::cos(phase);
    after.sine(k, c) = set.amplitude * std::sin(phase);
  }
  return after;
}

Spectrum edited(const Gain& gain, const Selection& selection, const Spectrum& before, double rest) {
  Spectrum after = before;
  const Band band = band_within(selection, before.harmonics());
  for (int k = band.first; k <= band.last; ++k) {
    if (k == 0) {
      after.cosine.row(0).array() = rest + gain.factor * (before.cosine.row(0).array() - rest);
      after.cubic *= gain.factor;
    } else {
      after.cosine.row(k) *= gain.factor;
      if (before.kind == Kind::loop) after.sine.row(k) *= gain.factor;
    }
  }
  return after;
}

Spectrum shifted_loop(const Shift& shift, const Band& band, const Spectrum& before) {
  Spectrum after = before;
  for (int k = std::max(band.first, 1); k <= band.last; ++k) {
    const double turn = 2 * kPi * k * shift.by;
    after.cosine.row(k) = std::cos(turn) * before.cosine.row(k) - std::sin(turn) * before.sine.row(k);
    after.sine.row(k) = std::sin(turn) * before.cosine.row(k) + std::cos(turn) * before.sine.row(k);
  }
  return after;
}

Spectrum shifted_one_shot(const Shift& shift, const Band& band, const Spectrum& before) {
  Spectrum moving = before;
  Spectrum staying = before;
  for (int k = 0; k <= before.harmonics(); ++k) (contains(band, k) ? staying : moving).cosine.row(k).setZero();
  (contains(band, 0) ? staying : moving).cubic.setZero();
  const int n = before.samples;
  Eigen::MatrixXd samples = synthesise_samples(staying, n);
  for (int j = 0; j < n; ++j) samples.row(j) += synthesise(moving, static_cast<double>(j) / (n - 1) - shift.by).transpose();
  return analyse_one_shot(samples, max_harmonics(Kind::one_shot, n));
}

Spectrum edited(const Shift& shift, const Selection& selection, const Spectrum& before, double) {
  const Band band = band_within(selection, before.harmonics());
  return before.kind == Kind::loop ? shifted_loop(shift, band, before) : shifted_one_shot(shift, band, before);
}

Spectrum edited(const Filter& filter, const Selection& selection, const Spectrum& before, double) {
  const Band asked = selection.band.value_or(Band{0, before.harmonics()});
  Spectrum after = truncated(before, std::min(asked.last, before.harmonics()), filter.roll_off);
  for (int k = 1; k < std::min(asked.first, after.harmonics() + 1); ++k) {
    after.cosine.row(k).setZero();
    if (after.kind == Kind::loop) after.sine.row(k).setZero();
  }
  return after;
}

/// How much of an edit is heard at a phase: 1 within the range, 0 outside, a raised cosine between. At the ends of a
/// one-shot there is nothing to fade from.
double heard(const PhaseRange& range, Kind kind, double phase) {
  double since_start = phase - range.from;
  double length = range.to - range.from;
  if (kind == Kind::loop) {
    since_start -= std::floor(since_start);
    if (length <= 0) length += 1;
  }
  const double until_end = length - since_start;
  if (since_start < 0 || until_end < 0) return 0;
  const bool opens = kind == Kind::loop ? length < 1 : range.from > 0;
  const bool closes = kind == Kind::loop ? length < 1 : range.to < 1;
  const double fade = std::min(kFade, length / 2);
  const double inside = std::min(opens ? since_start : fade, closes ? until_end : fade);
  return inside >= fade ? 1 : 0.5 * (1 - std::cos(kPi * inside / fade));
}

Spectrum blended(const Spectrum& before, const Spectrum& after, const PhaseRange& range) {
  const int n = before.samples;
  Eigen::MatrixXd samples = synthesise_samples(before, n);
  const Eigen::MatrixXd target = synthesise_samples(after, n);
  for (int j = 0; j < n; ++j) {
    const double phase = static_cast<double>(j) / (before.kind == Kind::loop ? n : n - 1);
    samples.row(j) += heard(range, before.kind, phase) * (target.row(j) - samples.row(j));
  }
  return analyse(before.kind, samples, max_harmonics(before.kind, n));
}

std::string broken_rule(const SetHarmonic& set, Kind kind, int samples) {
  const int most = max_harmonics(kind, samples);
  if (set.harmonic < 0 || set.harmonic > most) {
    return "harmonic " + std::to_string(set.harmonic) + " is not in 0 to " + std::to_string(most) + ", which " +
           std::to_string(samples) + " samples allow";
  }
  if (!std::isfinite(set.amplitude)) return "amplitude is not a finite number";
  if (!set.phase) return "";
  if (!std::isfinite(*set.phase)) return "phase is not a finite number";
  if (set.harmonic == 0) return "harmonic 0 is the mean and has no phase";
  if (kind == Kind::one_shot) return "the cosines of a one-shot have no phase";
  return "";
}

std::string broken_rule(const Gain& gain, Kind, int) {
  return std::isfinite(gain.factor) ? "" : "factor is not a finite number";
}

std::string broken_rule(const Shift& shift, Kind, int) {
  return std::abs(shift.by) <= 1 ? "" : "shift is not a share of the period within -1 to 1";
}

std::string broken_rule(const Filter& filter, Kind, int) { return filter.roll_off >= 0 ? "" : "roll-off is below 0"; }

std::string broken_rule(const Selection& selection, Kind kind) {
  if (selection.band && (selection.band->first < 0 || selection.band->last < selection.band->first)) {
    return "band " + std::to_string(selection.band->first) + " to " + std::to_string(selection.band->last) +
           " does not run upward from 0 or above";
  }
  if (!selection.range) return "";
  const auto [from, to] = *selection.range;
  if (!(from >= 0 && from <= 1 && to >= 0 && to <= 1)) return "range is not within 0 to 1";
  if (kind == Kind::one_shot && from >= to) return "range of a one-shot does not run forward";
  if (from == to || from - to == 1) return "range is empty";
  return "";
}

}  // namespace

std::string broken_rule(const Layer& layer, Kind kind, int samples) {
  const std::string of_selection = broken_rule(layer.selection, kind);
  if (!of_selection.empty()) return of_selection;
  return std::visit([&](const auto& edit) { return broken_rule(edit, kind, samples); }, layer.edit);
}

std::string broken_rule(const std::vector<Layer>& layers, const Spectrum& solved, const std::vector<Label>& labels, double rest) {
  const auto is_reckonable = [&](const std::vector<Layer>& some) {
    const Spectrum result = apply(some, solved, labels, rest).spectrum;
    return std::isfinite(result.cosine.squaredNorm() + result.sine.squaredNorm() + result.cubic.squaredNorm());
  };
  if (is_reckonable(layers)) return "";
  std::vector<Layer> first;
  for (const Layer& layer : layers) {
    first.push_back(layer);
    if (!is_reckonable(first)) return "layer '" + layer.name + "' makes the signals too large to be reckoned with";
  }
  return "";
}

std::vector<int> selected_channels(const Selection& selection, const std::vector<Label>& labels) {
  std::vector<int> channels;
  for (std::size_t c = 0; c < labels.size(); ++c) {
    if (matches(selection.channel, labels[c].name) && matches(selection.group, labels[c].group)) {
      channels.push_back(static_cast<int>(c));
    }
  }
  return channels;
}

Edited apply(const std::vector<Layer>& layers, const Spectrum& solved, const std::vector<Label>& labels, double rest) {
  assert(static_cast<Eigen::Index>(labels.size()) == solved.channels());
  Edited result{solved, {}};
  for (const Layer& layer : layers) {
    assert(broken_rule(layer, solved.kind, solved.samples).empty());
    const std::vector<int> channels = selected_channels(layer.selection, labels);
    result.touched.push_back(static_cast<int>(channels.size()));
    if (channels.empty()) continue;
    const Spectrum before = some_channels(result.spectrum, channels);
    Spectrum after = std::visit([&](const auto& edit) { return edited(edit, layer.selection, before, rest); }, layer.edit);
    if (layer.selection.range) after = blended(before, after, *layer.selection.range);
    put_channels(after, channels, result.spectrum);
  }
  return result;
}

}  // namespace hydrostat::signal

#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "signal/spectrum.h"

namespace hydrostat::signal {

/// What a channel is called by: its own name, and the group that it shares with others.
struct Label {
  std::string name;
  std::string group;
};

struct Band {
  int first = 0;
  int last = 0;  // inclusive
};

/// Part of the period, in phase. Of a loop it may run over the end: 0.9 to 0.1.
struct PhaseRange {
  double from = 0;
  double to = 1;
};

/// Which part of which signals a layer touches. Patterns are those of a shell: * ? [abc].
struct Selection {
  std::string channel = "*";
  std::string group = "*";
  std::optional<Band> band = {};         // none: all harmonics
  std::optional<PhaseRange> range = {};  // none: always
};

/// Gives one harmonic an amplitude; the selection's band has no say. The part of a loop becomes
/// amplitude * cos(2 pi harmonic phase - `phase`); without a phase the present one stays. Harmonic 0 is the mean and has no
/// phase, a one-shot's cosines have none either.
struct SetHarmonic {
  int harmonic = 1;
  double amplitude = 0;
  std::optional<double> phase;  // [rad]
};

/// Multiplies the band; of harmonic 0 the deviation from the signal's rest.
struct Gain {
  double factor = 1;
};

/// Lets the band come later by a share of the period (of the duration of a one-shot, whose ends are held).
struct Shift {
  double by = 0;
};

/// Keeps the band and the mean, drops the rest; the last `roll_off` harmonics of the band fade by a raised cosine.
struct Filter {
  int roll_off = 0;
};

/// One edit. Layers lie over solved coefficients in order, so that solving anew keeps them.
struct Layer {
  std::string name;
  Selection selection;
  std::variant<SetHarmonic, Gain, Shift, Filter> edit;
};

/// Says which value of the layer breaks which rule for signals of this kind and number of samples; empty when all is well.
std::string broken_rule(const Layer& layer, Kind kind, int samples);

/// The same of layers that break no rule alone, over these signals: names the first that takes them beyond what can be reckoned with (a
/// coefficient whose square is no finite number).
std::string broken_rule(const std::vector<Layer>& layers, const Spectrum& solved, const std::vector<Label>& labels, double rest);

/// Indices of the channels that the patterns name, ascending.
std::vector<int> selected_channels(const Selection& selection, const std::vector<Label>& labels);

struct Edited {
  Spectrum spectrum;
  std::vector<int> touched;  // channels that each layer touched
};

/// Applies the layers, none of which breaks a rule, one after the other. labels has one entry per channel; `rest` is the
/// value that a signal without motion has. Edits within a part of the period, and shifts of one-shots, are made on the
/// samples, so the result may have more harmonics than `solved`.
Edited apply(const std::vector<Layer>& layers, const Spectrum& solved, const std::vector<Label>& labels, double rest);

}  // namespace hydrostat::signal

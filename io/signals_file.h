#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "retarget/signal_set.h"

namespace hydrostat::io {

/// signals.json, schema "hydrostat.signals/1": a text that a person can edit. Numbers are written with as many digits as
/// bring them back to the bit.
///   kind "loop" or "one_shot", period_s, samples, rate_hz, harmonics (told for the reader), limit,
///   layers [{name, edit: set|gain|shift|filter, channel, bone, band, range, and the edit's own numbers}],
///   channels [{name, bone, nodes, rest_length, stiffness, activation {cosine, sine | cubic}, force {cosine, sine |
///   cubic}}]:
/// coefficients as in signal::Spectrum, harmonic 0 first.
std::string signals_text(const retarget::SignalSet& set);

/// The signals in such a text. `file` is what the messages call it. Throws Error with file, place and mend for anything that
/// is not of the form above: not JSON, another schema, numbers that are missing, not finite, out of range, or lists of
/// another length.
retarget::SignalSet parse_signals(const std::string& text, const std::string& file);

/// Written beside and renamed when whole. Throws Error where that fails, or where a number is not finite.
void write_signals(const std::filesystem::path& file, const retarget::SignalSet& set);

/// Throws Error also where the file cannot be read.
retarget::SignalSet read_signals(const std::filesystem::path& file);

/// Signals, and apart from them their layers as the file has them, for whoever mends what read_signals refuses there.
struct SignalsToMend {
  struct FiledLayer {
    std::string name;                    // empty where it has none
    std::optional<signal::Layer> layer;  // none where it cannot be read
    std::string fault;                   // what is wrong with it alone; empty: nothing
  };
  retarget::SignalSet solved;  // without layers
  std::vector<FiledLayer> layers;
};

/// Throws Error as read_signals does, but not for what is wrong with a layer or with all of them together.
SignalsToMend read_signals_to_mend(const std::filesystem::path& file);

/// What `hydrostat signals DIR list --json` prints, schema "hydrostat.signals_list/1".
std::string signals_list_text(const retarget::SignalSet& set, const retarget::EditedActivations& edited,
                              const std::vector<retarget::BoneSignals>& bones);

/// The layers as in signals.json, in a list of their own: what `hydrostat signals DIR layers --json` prints.
std::string layers_text(const retarget::SignalSet& set);

}  // namespace hydrostat::io

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/subcommands.h"
#include "io/signals_file.h"
#include "io/signals_plot.h"
#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::cli {

namespace {

using retarget::SignalSet;

constexpr std::size_t kNamesShown = 12;  // in a message

/// What was typed, for whichever verb.
struct SignalsOptions {
  std::string directory;
  signal::Selection selection;
  std::string band, range;  // "K0:K1", "FROM:TO"
  std::string name;
  signal::SetHarmonic set;
  double phase = 0;
  double factor = 1;
  double by = 0;
  double seconds = 0;
  int low_pass = 0;
  int roll_off = 0;
  int layer = 0;
  bool json = false;
};

std::filesystem::path signals_path(const SignalsOptions& options) {
  return std::filesystem::path(options.directory) / "signals.json";
}

UsageError usage(const std::string& option, const std::string& what, const std::string& mend) {
  return {"hydrostat signals", "option " + option, what, mend};
}

/// Both halves of "A:B"; an empty half is what `first` or `last` says.
std::pair<double, double> parse_pair(const std::string& option, const std::string& text, double first, double last) {
  const std::string mend =
      "Write two numbers with a colon between, such as " + option + (option == "--band" ? " 1:4." : " 0.25:0.5.");
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) throw usage(option, "'" + text + "' has no colon", mend);
  const auto half = [&](const std::string& digits, double otherwise) {
    double value = otherwise;
    if (!digits.empty() && (!CLI::detail::lexical_cast(digits, value) || !std::isfinite(value))) {
      throw usage(option, "'" + digits + "' is not a number", mend);
    }
    return value;
  };
  return {half(text.substr(0, colon), first), half(text.substr(colon + 1), last)};
}

signal::Band parse_band(const std::string& text, const SignalSet& set) {
  const int most = signal::max_harmonics(set.kind(), set.samples());
  const auto [first, last] = parse_pair("--band", text, 0, most);
  if (first != std::floor(first) || last != std::floor(last) || !(0 <= first && first <= last && last <= most)) {
    throw usage("--band", "'" + text + "' is not a band of whole harmonics within 0:" + std::to_string(most),
                "Give the first and the last harmonic, upward.");
  }
  return {static_cast<int>(first), static_cast<int>(last)};
}

/// The selection as typed, its band and range understood.
signal::Selection selection_of(const SignalsOptions& options, const SignalSet& set) {
  signal::Selection selection = options.selection;
  if (!options.band.empty()) selection.band = parse_band(options.band, set);
  if (!options.range.empty()) {
    const auto [from, to] = parse_pair("--range", options.range, 0, 1);
    selection.range = signal::PhaseRange{from, to};
  }
  return selection;
}

std::string some_names(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kNamesShown); ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kNamesShown) text += " and " + std::to_string(names.size() - kNamesShown) + " more";
  return text;
}

Error nothing_selected(const SignalsOptions& options, const signal::Selection& selection, const SignalSet& set) {
  std::vector<std::string> channels;
  std::vector<std::string> bones;
  for (const signal::Label& label : set.channels) {
    channels.push_back(label.name);
    if (std::find(bones.begin(), bones.end(), label.group) == bones.end()) bones.push_back(label.group);
  }
  return {signals_path(options).string(), "selection",
          "no channel matches --channel '" + selection.channel + "' --bone '" + selection.group + "'",
          "Choose among the bones " + some_names(bones) + " and the channels " + some_names(channels) + "."};
}

std::vector<int> chosen_channels(const SignalsOptions& options, const signal::Selection& selection, const SignalSet& set) {
  const std::vector<int> channels = signal::selected_channels(selection, set.channels);
  if (channels.empty()) throw nothing_selected(options, selection, set);
  return channels;
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string clipping(const SignalSet& set, const retarget::EditedActivations& edited) {
  const std::string all = std::to_string(edited.samples.size());
  return std::to_string(edited.clipped) + " of " + all + " samples held at the limit of 1 +- " + short_number(set.limit) +
         " (" + std::to_string(edited.solved_clipped) + " without layers)";
}

struct EditDescription {
  std::string operator()(const signal::SetHarmonic& set) const {
    const std::string phase = set.phase ? ", phase " + short_number(*set.phase) + " rad" : "";
    return "set harmonic " + std::to_string(set.harmonic) + " to amplitude " + short_number(set.amplitude) + phase;
  }
  std::string operator()(const signal::Gain& gain) const { return "gain by " + short_number(gain.factor); }
  std::string operator()(const signal::Shift& shift) const {
    return "shift by " + short_number(shift.by) + " of the period";
  }
  std::string operator()(const signal::Filter& filter) const {
    return filter.roll_off == 0 ? "filter" : "filter, roll-off over " + std::to_string(filter.roll_off);
  }
};

std::string description(const signal::Layer& layer) {
  std::string text = "'" + layer.name + "': " + std::visit(EditDescription(), layer.edit) + ", channel '" +
                     layer.selection.channel + "', bone '" + layer.selection.group + "'";
  if (const auto& band = layer.selection.band) {
    text += ", band " + std::to_string(band->first) + ":" + std::to_string(band->last);
  }
  if (const auto& range = layer.selection.range)
    text += ", range " + short_number(range->from) + ":" + short_number(range->to);
  return text;
}

// ---- the verbs

void list(const SignalsOptions& options) {
  const SignalSet set = io::read_signals(signals_path(options));
  const retarget::EditedActivations edited = retarget::edited_activations(set);
  const auto bones = retarget::signals_by_bone(set, edited, chosen_channels(options, options.selection, set));
  if (options.json) {
    std::cout << io::signals_list_text(set, edited, bones);
    return;
  }
  std::cout << (set.kind() == signal::Kind::loop ? "loop of " : "one-shot of ") << short_number(set.period_s) << " s, "
            << set.samples() << " samples, " << set.activation.harmonics() << " harmonics, " << set.count() << " channels, "
            << set.layers.size() << " layers; " << clipping(set, edited) << "\n";
  for (const retarget::BoneSignals& bone : bones) {
    std::cout << bone.bone << ": " << bone.channels.size() << " channels, mean " << short_number(bone.mean) << ", rms "
              << short_number(bone.rms) << ", " << short_number(bone.lowest) << " to " << short_number(bone.highest)
              << ", harmonics";
    for (const auto& [harmonic, amplitude] : bone.strongest)
      std::cout << " " << harmonic << " (" << short_number(amplitude) << ")";
    std::cout << "\n";
  }
}

void plot(const SignalsOptions& options) {
  const SignalSet set = io::read_signals(signals_path(options));
  const std::vector<int> channels = chosen_channels(options, options.selection, set);
  const retarget::EditedActivations edited = retarget::edited_activations(set);
  const std::filesystem::path file = std::filesystem::path(options.directory) / "signals.svg";
  io::write_file(file, io::signals_plot(set, edited, retarget::signals_by_bone(set, edited, channels)));
  std::cout << file.string() << ": " << channels.size() << " channels; " << clipping(set, edited) << "\n";
}

/// Appends a layer to the file and tells what it does.
void append(const SignalsOptions& options, const SignalSet& before, const signal::Layer& layer, const std::string& option) {
  SignalSet set = before;
  const std::string broken = signal::broken_rule(layer, set.kind(), set.samples());
  if (!broken.empty()) throw usage(option, broken, "'hydrostat signals DIR list' tells the kind and the harmonics.");
  const std::vector<int> channels = chosen_channels(options, layer.selection, set);
  set.layers.push_back(layer);
  const std::string too_large = signal::broken_rule(set.layers, set.activation, set.channels, retarget::kPassiveActivation);
  if (!too_large.empty()) throw usage(option, too_large, "Give less, or drop earlier layers with 'hydrostat signals DIR reset'.");
  const retarget::EditedActivations edited = retarget::edited_activations(set);
  io::write_signals(signals_path(options), set);
  std::cout << "layer " << set.layers.size() << " " << description(layer) << ": " << channels.size() << " channels touched; "
            << clipping(set, edited) << "\n";
}

using Edit = decltype(signal::Layer::edit);

signal::Layer layer_of(const SignalsOptions& options, const SignalSet& set, const std::string& verb, const Edit& edit) {
  const std::string name = options.name.empty() ? verb + " " + std::to_string(set.layers.size() + 1) : options.name;
  return {name, selection_of(options, set), edit};
}

void set_harmonic(const SignalsOptions& options, bool has_phase) {
  const SignalSet set = io::read_signals(signals_path(options));
  signal::SetHarmonic edit = options.set;
  if (has_phase) edit.phase = options.phase;
  append(options, set, layer_of(options, set, "set", edit), "--harmonic, --amplitude, --phase or --range");
}

void gain(const SignalsOptions& options) {
  const SignalSet set = io::read_signals(signals_path(options));
  append(options, set, layer_of(options, set, "gain", signal::Gain{options.factor}), "--factor or --range");
}

void shift(const SignalsOptions& options, bool in_seconds) {
  const SignalSet set = io::read_signals(signals_path(options));
  const double by = in_seconds ? options.seconds / set.period_s : options.by;
  append(options, set, layer_of(options, set, "shift", signal::Shift{by}), "--by, --seconds or --range");
}

void filter(const SignalsOptions& options, bool is_low_pass) {
  const SignalSet set = io::read_signals(signals_path(options));
  signal::Layer layer = layer_of(options, set, "filter", signal::Filter{options.roll_off});
  if (is_low_pass) layer.selection.band = signal::Band{0, options.low_pass};
  append(options, set, layer, "--low-pass, --band or --range");
}

/// What can be told of layers that lie over the signals: samples at the limit, or what is wrong with all of them together.
std::string outcome_of_layers(const SignalSet& set) {
  const std::string too_large = signal::broken_rule(set.layers, set.activation, set.channels, retarget::kPassiveActivation);
  return too_large.empty() ? clipping(set, retarget::edited_activations(set)) : too_large;
}

void list_layers(const SignalsOptions& options) {
  if (options.json) {
    std::cout << io::layers_text(io::read_signals(signals_path(options)));
    return;
  }
  auto [set, filed] = io::read_signals_to_mend(signals_path(options));
  bool are_sound = true;
  for (std::size_t l = 0; l < filed.size(); ++l) {
    const auto& [name, layer, fault] = filed[l];
    std::cout << l + 1 << " " << (layer ? description(*layer) : "'" + name + "'") << ": ";
    if (fault.empty()) {
      std::cout << signal::selected_channels(layer->selection, set.channels).size() << " channels touched\n";
      set.layers.push_back(*layer);
    } else {
      std::cout << "refused: " << fault << "\n";
      are_sound = false;
    }
  }
  std::cout << filed.size() << " layers; " << (are_sound ? outcome_of_layers(set) : "'hydrostat signals DIR reset' drops those that are refused, or all")
            << "\n";
}

/// The layers that are kept must be such that they can be written again, not such that they can be played.
void reset(const SignalsOptions& options, bool only_one) {
  auto [set, filed] = io::read_signals_to_mend(signals_path(options));
  const auto count = static_cast<int>(filed.size());
  if (only_one && (options.layer < 1 || options.layer > count)) {
    throw usage("--layer",
                "layer " + std::to_string(options.layer) + " is not among the " + std::to_string(count) + " that exist",
                "'hydrostat signals DIR layers' lists them.");
  }
  bool are_sound = true;
  for (int l = 1; only_one && l <= count; ++l) {
    const io::SignalsToMend::FiledLayer& kept = filed[static_cast<std::size_t>(l - 1)];
    if (l == options.layer) continue;
    if (!kept.layer) {
      throw Error(signals_path(options).string(), "layer " + std::to_string(l), kept.fault, "Drop it first, or all layers: leave --layer out.");
    }
    are_sound = are_sound && kept.fault.empty();
    set.layers.push_back(*kept.layer);
  }
  io::write_signals(signals_path(options), set);
  std::cout << count - static_cast<int>(set.layers.size()) << " layers dropped, " << set.layers.size() << " left; "
            << (are_sound ? outcome_of_layers(set) : "'hydrostat signals DIR layers' tells which of them are refused") << "\n";
}

// ---- their options

using Options = std::shared_ptr<SignalsOptions>;

void add_selection(CLI::App& verb, const Options& options) {
  verb.add_option("--channel", options->selection.channel, "Channels by pattern (* ? [abc]), such as 'edge/12-*'");
  verb.add_option("--bone", options->selection.group, "Bones by pattern, such as 'FL_*'");
}

void add_layer_options(CLI::App& verb, const Options& options) {
  add_selection(verb, options);
  verb.add_option("--range", options->range, "FROM:TO, part of the period (0 to 1) in which the edit is heard");
  verb.add_option("--name", options->name, "Name of the layer");
}

CLI::Option* add_band(CLI::App& verb, const Options& options) {
  return verb.add_option("--band", options->band, "K0:K1, harmonics from K0 to K1; an empty half is open");
}

void add_set(CLI::App& signals, const Options& options) {
  CLI::App& verb = *signals.add_subcommand("set", "Give one harmonic an amplitude (a layer)");
  add_layer_options(verb, options);
  verb.add_option("--harmonic", options->set.harmonic, "Harmonic; 0 is the mean")->required();
  verb.add_option("--amplitude", options->set.amplitude, "Amplitude [-]; of harmonic 0 the mean activation itself")
      ->required();
  CLI::Option* phase =
      verb.add_option("--phase", options->phase, "Phase [rad] at which a cosine peaks; without it the phase stays");
  verb.callback([options, phase] { set_harmonic(*options, phase->count() > 0); });
}

void add_gain(CLI::App& signals, const Options& options) {
  CLI::App& verb = *signals.add_subcommand("gain", "Multiply harmonics; 0 as its deviation from 1 (a layer)");
  add_layer_options(verb, options);
  add_band(verb, options);
  verb.add_option("--factor", options->factor, "Factor [-]")->required();
  verb.callback([options] { gain(*options); });
}

void add_shift(CLI::App& signals, const Options& options) {
  CLI::App& verb = *signals.add_subcommand("shift", "Let harmonics come later (a layer)");
  add_layer_options(verb, options);
  add_band(verb, options);
  CLI::Option_group& amount = *verb.add_option_group("amount");
  amount.add_option("--by", options->by, "Share of the period, -1 to 1; above 0 is later");
  CLI::Option* seconds = amount.add_option("--seconds", options->seconds, "Time [s]; above 0 is later");
  amount.require_option(1);
  verb.callback([options, seconds] { shift(*options, seconds->count() > 0); });
}

void add_filter(CLI::App& signals, const Options& options) {
  CLI::App& verb = *signals.add_subcommand("filter", "Keep the mean and some harmonics, drop the others (a layer)");
  add_layer_options(verb, options);
  CLI::Option_group& pass = *verb.add_option_group("pass");
  CLI::Option* low_pass =
      pass.add_option("--low-pass", options->low_pass, "Keep harmonics up to this one")->check(CLI::NonNegativeNumber);
  pass.add_option("--band", options->band, "K0:K1, keep harmonics from K0 to K1; an empty half is open");
  pass.require_option(1);
  verb.add_option("--roll-off", options->roll_off, "The last harmonics that are kept and fade")
      ->check(CLI::NonNegativeNumber);
  verb.callback([options, low_pass] { filter(*options, low_pass->count() > 0); });
}

void add_looks(CLI::App& signals, const Options& options) {
  CLI::App& list_verb = *signals.add_subcommand("list", "Channels by bone: mean, rms, strongest harmonics");
  add_selection(list_verb, options);
  list_verb.add_flag("--json", options->json, "For machines");
  list_verb.callback([options] { list(*options); });
  CLI::App& plot_verb = *signals.add_subcommand("plot", "Draw the channels over the period to DIR/signals.svg");
  add_selection(plot_verb, options);
  plot_verb.callback([options] { plot(*options); });
  CLI::App& layers_verb = *signals.add_subcommand("layers", "List the layers in their order");
  layers_verb.add_flag("--json", options->json, "For machines");
  layers_verb.callback([options] { list_layers(*options); });
}

void add_reset(CLI::App& signals, const Options& options) {
  CLI::App& verb = *signals.add_subcommand("reset", "Drop the layers; the solved coefficients stay");
  CLI::Option* layer = verb.add_option("--layer", options->layer, "Only this one, counted from 1");
  verb.callback([options, layer] { reset(*options, layer->count() > 0); });
}

}  // namespace

void add_signals(CLI::App& app, int&) {
  const auto options = std::make_shared<SignalsOptions>();
  CLI::App& signals = *app.add_subcommand("signals", "Look at a creature's activations and edit them in layers");
  signals.add_option("DIR", options->directory, "Creature, as convert wrote it")->required();
  signals.require_subcommand(1);
  add_looks(signals, options);
  add_set(signals, options);
  add_gain(signals, options);
  add_shift(signals, options);
  add_filter(signals, options);
  add_reset(signals, options);
}

}  // namespace hydrostat::cli

#include "io/signals_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io {

namespace {

using Json = nlohmann::ordered_json;
using retarget::SignalSet;
using signal::Kind;
using signal::Spectrum;

constexpr const char* kSignalsSchema = "hydrostat.signals/1";
constexpr const char* kListSchema = "hydrostat.signals_list/1";
constexpr int kMostSamples = 100'000;  // minutes at any control rate: more is a slip of the pen
constexpr const char* kDropLayers = "'hydrostat signals DIR reset' drops layers";

const char* kind_name(Kind kind) { return kind == Kind::loop ? "loop" : "one_shot"; }

// ---- writing

/// A list of numbers or names.
bool is_plain_list(const Json& value) {
  return value.is_array() &&
         std::none_of(value.begin(), value.end(), [](const Json& entry) { return entry.is_structured(); });
}

/// One value in one line. A bone's name comes from a foreign file: bytes that are no UTF-8 become U+FFFD instead of stopping
/// us.
std::string in_one_line(const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// JSON with one member a line and lists of numbers in one line: what a person can find a place in.
void print(const Json& value, int depth, std::string& text) {
  if (!value.is_structured()) {
    text += in_one_line(value);
    return;
  }
  if (is_plain_list(value)) {
    const char* before = "[";
    for (const Json& entry : value) {
      text += before + in_one_line(entry);
      before = ", ";
    }
    text += value.empty() ? "[]" : "]";
    return;
  }
  const std::string indent(static_cast<std::size_t>(2 * (depth + 1)), ' ');
  const char* between = "\n";
  text += value.is_object() ? '{' : '[';
  for (const auto& [key, entry] : value.items()) {
    text += between + indent;
    if (value.is_object()) text += in_one_line(key) + ": ";
    print(entry, depth + 1, text);
    between = ",\n";
  }
  text += '\n' + std::string(static_cast<std::size_t>(2 * depth), ' ') + (value.is_object() ? '}' : ']');
}

std::string printed(const Json& value) {
  std::string text;
  print(value, 0, text);
  return text + '\n';
}

Json column(const Eigen::MatrixXd& coefficients, Eigen::Index c) {
  Json list = Json::array();
  for (Eigen::Index k = 0; k < coefficients.rows(); ++k) list.push_back(coefficients(k, c));
  return list;
}

Json coefficients(const Spectrum& spectrum, Eigen::Index c) {
  Json json;
  if (spectrum.kind == Kind::one_shot) json["cubic"] = column(spectrum.cubic, c);
  json["cosine"] = column(spectrum.cosine, c);
  if (spectrum.kind == Kind::loop) json["sine"] = column(spectrum.sine, c);
  return json;
}

struct EditWriter {
  Json& json;
  void operator()(const signal::SetHarmonic& set) const {
    json["edit"] = "set";
    json["harmonic"] = set.harmonic;
    json["amplitude"] = set.amplitude;
    if (set.phase) json["phase"] = *set.phase;
  }
  void operator()(const signal::Gain& gain) const {
    json["edit"] = "gain";
    json["factor"] = gain.factor;
  }
  void operator()(const signal::Shift& shift) const {
    json["edit"] = "shift";
    json["by"] = shift.by;
  }
  void operator()(const signal::Filter& filter) const {
    json["edit"] = "filter";
    json["roll_off"] = filter.roll_off;
  }
};

Json layer_json(const signal::Layer& layer) {
  Json json;
  json["name"] = layer.name;
  std::visit(EditWriter{json}, layer.edit);
  json["channel"] = layer.selection.channel;
  json["bone"] = layer.selection.group;
  if (layer.selection.band) json["band"] = {layer.selection.band->first, layer.selection.band->last};
  if (layer.selection.range) json["range"] = {layer.selection.range->from, layer.selection.range->to};
  return json;
}

Json layers_json(const SignalSet& set) {
  Json list = Json::array();
  for (const signal::Layer& layer : set.layers) list.push_back(layer_json(layer));
  return list;
}

Json channel_json(const SignalSet& set, Eigen::Index c) {
  const signal::Label& label = set.channels[static_cast<std::size_t>(c)];
  return {{"name", label.name},
          {"bone", label.group},
          {"nodes", {set.nodes(0, c), set.nodes(1, c)}},
          {"rest_length", set.rest_length[c]},
          {"stiffness", set.stiffness[c]},
          {"activation", coefficients(set.activation, c)},
          {"force", coefficients(set.force, c)}};
}

bool is_finite(const Spectrum& spectrum, Eigen::Index c) {
  return spectrum.cosine.col(c).allFinite() && spectrum.sine.col(c).allFinite() && spectrum.cubic.col(c).allFinite();
}

// ---- reading

/// A value in the file and the way to it, for messages.
class Place {
 public:
  Place(const Json& json, std::string file, std::string where)
      : json_(json), file_(std::move(file)), where_(std::move(where)) {}

  [[noreturn]] void refuse(const std::string& what, const std::string& mend) const {
    throw Error(file_, where_, what, mend);
  }

  const Json& json() const { return json_; }

  Place at(const std::string& key) const {
    must_be_object();
    const auto member = json_.find(key);
    if (member == json_.end()) refuse("'" + key + "' is missing", "Add it, or convert the clip again.");
    return {*member, file_, named(key)};
  }
  bool has(const std::string& key) const {
    must_be_object();
    return json_.contains(key);
  }
  Place entry(std::size_t index) const { return {json_[index], file_, where_ + "[" + std::to_string(index) + "]"}; }
  Place called(const std::string& name) const { return {json_, file_, name}; }

  std::size_t list_size() const {
    if (!json_.is_array()) refuse("not a list", "Write a list in [ ].");
    return json_.size();
  }
  void must_have_size(std::size_t size, const std::string& why) const {
    const std::size_t present = list_size();
    if (present == size) return;
    refuse("has " + std::to_string(present) + " entries, not " + std::to_string(size), why);
  }
  std::string text() const {
    if (!json_.is_string()) refuse("not a text", "Write it in quotation marks.");
    return json_.get<std::string>();
  }
  double number() const {
    if (!json_.is_number()) refuse("not a number", "Write a finite number.");
    const double value = json_.get<double>();
    if (!std::isfinite(value)) refuse("not finite", "Write a finite number.");
    return value;
  }
  double number_above(double bound) const {
    const double value = number();
    if (!(value > bound)) refuse(json_.dump() + " is not above " + Json(bound).dump(), "Write a greater number.");
    return value;
  }
  int whole_number(int least, int most) const {
    const bool fits = json_.is_number_integer() && json_.get<double>() >= least && json_.get<double>() <= most;
    if (!fits) {
      refuse(json_.dump() + " is not a whole number from " + std::to_string(least) + " to " + std::to_string(most),
             "Write such a number.");
    }
    return json_.get<int>();
  }

 private:
  void must_be_object() const {
    if (!json_.is_object()) refuse("not an object", "Write members in { }.");
  }
  std::string named(const std::string& key) const { return where_.empty() ? key : where_ + "." + key; }

  const Json& json_;
  std::string file_;
  std::string where_;
};

/// Numbers beyond double, on which the parser stops, become null: what reads them then tells where they are.
std::string without_infinite_numbers(const std::string& text) {
  std::string result;
  bool is_in_quotes = false;
  for (std::size_t i = 0; i < text.size();) {
    const bool is_number = !is_in_quotes && (text[i] == '-' || std::isdigit(static_cast<unsigned char>(text[i])) != 0);
    std::size_t end = i + 1;
    if (is_number) end = text.find_first_not_of("+-.0123456789eE", i);
    if (is_in_quotes && text[i] == '\\') ++end;  // with what it escapes
    end = std::min(end, text.size());
    const std::string piece = text.substr(i, end - i);
    if (piece == "\"") is_in_quotes = !is_in_quotes;
    result += is_number && std::isinf(std::strtod(piece.c_str(), nullptr)) ? "null" : piece;
    i = end;
  }
  return result;
}

Json parsed_json(const std::string& text, const std::string& file) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    const auto line = 1 + std::count(text.begin(), end, '\n');
    throw Error(file, "line " + std::to_string(line), "not JSON there",
                "Mend the line: a comma, quotation mark or bracket is amiss.");
  } catch (const Json::exception&) {  // a number beyond double
    throw Error(file, "", "has a number that is too large", std::string("Write finite numbers; where a layer has it, ") + kDropLayers + ".");
  }
}

void check_schema(const Place& root) {
  const Place schema = root.at("schema");
  const std::string name = schema.text();
  if (name != kSignalsSchema) {
    schema.refuse("'" + name + "' is not known here",
                  std::string("This version reads '") + kSignalsSchema + "'; convert the clip again.");
  }
}

Kind read_kind(const Place& place) {
  const std::string name = place.text();
  if (name == kind_name(Kind::loop)) return Kind::loop;
  if (name == kind_name(Kind::one_shot)) return Kind::one_shot;
  place.refuse("'" + name + "' is no kind of signal", "Write \"loop\" or \"one_shot\".");
}

void read_column(const Place& list, Eigen::Ref<Eigen::VectorXd> column, const std::string& why) {
  list.must_have_size(static_cast<std::size_t>(column.size()), why);
  for (Eigen::Index k = 0; k < column.size(); ++k) column[k] = list.entry(static_cast<std::size_t>(k)).number();
}

void read_coefficients(const Place& place, Eigen::Index c, Spectrum& spectrum) {
  const std::string why =
      "Give one entry per harmonic, 0 to " + std::to_string(spectrum.harmonics()) + ", in every channel.";
  read_column(place.at("cosine"), spectrum.cosine.col(c), why);
  if (spectrum.kind == Kind::one_shot) {
    read_column(place.at("cubic"), spectrum.cubic.col(c), "Give the powers 0 to 3 of the phase.");
    return;
  }
  read_column(place.at("sine"), spectrum.sine.col(c), why);
  if (spectrum.sine(0, c) != 0) place.at("sine").entry(0).refuse("the mean has no sine", "Write 0.");
}

signal::Band read_band(const Place& place) {
  place.must_have_size(2, "Write the first and the last harmonic.");
  return {place.entry(0).whole_number(0, kMostSamples), place.entry(1).whole_number(0, kMostSamples)};
}

signal::PhaseRange read_range(const Place& place) {
  place.must_have_size(2, "Write where it begins and ends, as parts of the period.");
  return {place.entry(0).number(), place.entry(1).number()};
}

std::variant<signal::SetHarmonic, signal::Gain, signal::Shift, signal::Filter> read_edit(const Place& layer) {
  const Place edit = layer.at("edit");
  const std::string name = edit.text();
  if (name == "set") {
    signal::SetHarmonic set{layer.at("harmonic").whole_number(0, kMostSamples), layer.at("amplitude").number(),
                            std::nullopt};
    if (layer.has("phase")) set.phase = layer.at("phase").number();
    return set;
  }
  if (name == "gain") return signal::Gain{layer.at("factor").number()};
  if (name == "shift") return signal::Shift{layer.at("by").number()};
  if (name == "filter")
    return signal::Filter{layer.has("roll_off") ? layer.at("roll_off").whole_number(0, kMostSamples) : 0};
  edit.refuse("'" + name + "' is no edit", "Write \"set\", \"gain\", \"shift\" or \"filter\".");
}

signal::Layer read_layer(const Place& place) {
  signal::Layer layer{place.at("name").text(), {}, read_edit(place)};
  if (place.has("channel")) layer.selection.channel = place.at("channel").text();
  if (place.has("bone")) layer.selection.group = place.at("bone").text();
  if (place.has("band")) layer.selection.band = read_band(place.at("band"));
  if (place.has("range")) layer.selection.range = read_range(place.at("range"));
  return layer;
}

signal::Layer read_sound_layer(const Place& place, const SignalSet& set) {
  const signal::Layer layer = read_layer(place);
  const std::string broken = signal::broken_rule(layer, set.kind(), set.samples());
  if (!broken.empty()) place.refuse(broken, std::string("Change the number, or drop the layer: ") + kDropLayers + ".");
  return layer;
}

SignalsToMend::FiledLayer read_filed_layer(const Place& entry, const SignalSet& set) {
  const Place place = entry.called("");  // faults are told of the layer itself
  SignalsToMend::FiledLayer filed;
  try {
    filed.name = place.at("name").text();
    filed.layer = read_layer(place);
    filed.fault = signal::broken_rule(*filed.layer, set.kind(), set.samples());
  } catch (const Error& error) {
    filed.fault = error.where.empty() ? error.what() : error.where + ": " + error.what();
  }
  return filed;
}

void read_channel(const Place& place, Eigen::Index c, SignalSet& set) {
  signal::Label& label = set.channels[static_cast<std::size_t>(c)];
  label.name = place.at("name").text();
  const Place channel = place.called("channel '" + label.name + "'");
  label.group = channel.at("bone").text();
  const Place nodes = channel.at("nodes");
  nodes.must_have_size(2, "Write the two nodes of the edge.");
  for (int end = 0; end < 2; ++end) {
    set.nodes(end, c) = nodes.entry(static_cast<std::size_t>(end)).whole_number(0, std::numeric_limits<int>::max());
  }
  if (set.nodes(0, c) == set.nodes(1, c)) nodes.refuse("both ends are one node", "Write two different nodes.");
  set.rest_length[c] = channel.at("rest_length").number_above(0);
  set.stiffness[c] = channel.at("stiffness").number();
  if (set.stiffness[c] < 0) channel.at("stiffness").refuse("below 0", "Write 0 or more.");
  read_coefficients(channel.at("activation"), c, set.activation);
  read_coefficients(channel.at("force"), c, set.force);
}

void check_rate(const Place& root, const SignalSet& set) {
  const Place rate = root.at("rate_hz");
  if (std::abs(rate.number() - set.rate_hz()) <= 1e-9 * set.rate_hz()) return;
  rate.refuse(rate.json().dump() + " does not agree with samples and period_s", "Write " + Json(set.rate_hz()).dump() + ".");
}

Spectrum empty_spectrum(Kind kind, int samples, int harmonics, Eigen::Index channels) {
  const bool loop = kind == Kind::loop;
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(harmonics + 1, channels);
  return {kind, samples, zero, loop ? zero : Eigen::MatrixXd(0, channels), Eigen::MatrixXd::Zero(loop ? 0 : 4, channels)};
}

/// All but the layers.
SignalSet read_solved(const Place& root) {
  check_schema(root);
  const Kind kind = read_kind(root.at("kind"));
  const int samples = root.at("samples").whole_number(kind == Kind::loop ? 2 : 4, kMostSamples);
  const int harmonics = root.at("harmonics").whole_number(0, signal::max_harmonics(kind, samples));
  SignalSet set;
  set.period_s = root.at("period_s").number_above(0);
  set.limit = root.at("limit").number_above(0);
  if (set.limit >= 1) root.at("limit").refuse("not below 1", "Write a number between 0 and 1.");
  const Place channels = root.at("channels");
  const std::size_t count = channels.list_size();
  const auto columns = static_cast<Eigen::Index>(count);
  set.channels.resize(count);
  set.nodes.resize(2, columns);
  set.rest_length.resize(columns);
  set.stiffness.resize(columns);
  set.activation = empty_spectrum(kind, samples, harmonics, columns);
  set.force = set.activation;
  check_rate(root, set);
  std::set<std::string> names;
  for (std::size_t c = 0; c < count; ++c) {
    read_channel(channels.entry(c), static_cast<Eigen::Index>(c), set);
    if (names.insert(set.channels[c].name).second) continue;
    channels.entry(c).refuse("'" + set.channels[c].name + "' stands there twice", "Give every channel a name of its own.");
  }
  return set;
}

}  // namespace

std::string signals_text(const SignalSet& set) {
  Json json;
  json["schema"] = kSignalsSchema;
  json["kind"] = kind_name(set.kind());
  json["period_s"] = set.period_s;
  json["samples"] = set.samples();
  json["rate_hz"] = set.rate_hz();
  json["harmonics"] = set.activation.harmonics();
  json["limit"] = set.limit;
  json["layers"] = layers_json(set);
  json["channels"] = Json::array();
  for (Eigen::Index c = 0; c < set.count(); ++c) json["channels"].push_back(channel_json(set, c));
  return printed(json);
}

SignalSet parse_signals(const std::string& text, const std::string& file) {
  const Json json = parsed_json(text, file);
  const Place root(json, file, "");
  SignalSet set = read_solved(root);
  const Place layers = root.at("layers");
  for (std::size_t l = 0; l < layers.list_size(); ++l) set.layers.push_back(read_sound_layer(layers.entry(l), set));
  const std::string too_large = signal::broken_rule(set.layers, set.activation, set.channels, retarget::kPassiveActivation);
  if (!too_large.empty()) layers.refuse(too_large, std::string("Give it a smaller number, or drop it: ") + kDropLayers + ".");
  return set;
}

void write_signals(const std::filesystem::path& file, const SignalSet& set) {
  for (Eigen::Index c = 0; c < set.count(); ++c) {
    if (is_finite(set.activation, c) && is_finite(set.force, c)) continue;
    throw Error(file.string(), "channel '" + set.channels[static_cast<std::size_t>(c)].name + "'",
                "a coefficient is not finite", "Look for a cause in the inverse dynamics before it.");
  }
  write_file(file, signals_text(set));
}

SignalSet read_signals(const std::filesystem::path& file) { return parse_signals(read_file(file), file.string()); }

SignalsToMend read_signals_to_mend(const std::filesystem::path& file) {
  const Json json = parsed_json(without_infinite_numbers(read_file(file)), file.string());
  const Place root(json, file.string(), "");
  SignalsToMend signals{read_solved(root), {}};
  const Place layers = root.at("layers");
  for (std::size_t l = 0; l < layers.list_size(); ++l) signals.layers.push_back(read_filed_layer(layers.entry(l), signals.solved));
  return signals;
}

std::string signals_list_text(const SignalSet& set, const retarget::EditedActivations& edited,
                              const std::vector<retarget::BoneSignals>& bones) {
  Json json;
  json["schema"] = kListSchema;
  json["kind"] = kind_name(set.kind());
  json["period_s"] = set.period_s;
  json["samples"] = set.samples();
  json["harmonics"] = set.activation.harmonics();
  json["limit"] = set.limit;
  json["layers"] = set.layers.size();
  json["clipped"] = edited.clipped;
  json["solved_clipped"] = edited.solved_clipped;
  json["bones"] = Json::array();
  for (const retarget::BoneSignals& bone : bones) {
    Json entry{{"bone", bone.bone},  {"mean", bone.mean},   {"rms", bone.rms},
               {"min", bone.lowest}, {"max", bone.highest}, {"harmonics", Json::array()}};
    for (const auto& [harmonic, amplitude] : bone.strongest) {
      entry["harmonics"].push_back({{"harmonic", harmonic}, {"amplitude", amplitude}});
    }
    for (const int c : bone.channels) entry["channels"].push_back(set.channels[static_cast<std::size_t>(c)].name);
    json["bones"].push_back(entry);
  }
  return printed(json);
}

std::string layers_text(const SignalSet& set) { return printed(layers_json(set)); }

}  // namespace hydrostat::io

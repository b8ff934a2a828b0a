#include "io/load_creature.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "io/body_file.h"
#include "io/creature_directory.h"
#include "io/path_file.h"
#include "io/signals_file.h"
#include "io/toml_reader.h"
#include "io/wobble_file.h"
#include "io/write_file.h"
#include "retarget/error.h"
#include "retarget/self_contact_plan.h"

namespace hydrostat::io {
namespace {

using Setting = CreatureRecord::Setting;

constexpr const char* kMend = "Make the creature again with 'hydrostat convert'.";
constexpr double kMostSeed = std::numeric_limits<unsigned>::max();
constexpr double kLongestStep = 1.0 / 120;  // [s], of the control

/// As it stands in the file.
std::string in_words(const Setting& value) {
  std::string line = to_toml({"", "", "", 0, {{"x", value}}, {}});
  line = line.substr(line.find("\nx = ") + 5);
  return line.substr(0, line.find('\n'));
}

Error setting_error(const std::string& file, const std::string& name, const Setting& value, const std::string& allowed) {
  return {file, "setting '" + name + "'", "is " + in_words(value) + ", where " + allowed + " belongs",
          "Mend the value, or make the creature again with 'hydrostat convert'."};
}

/// The words that a text may be.
std::optional<std::vector<std::string>> words_of(const std::string& name) {
  if (name == "wobble") return {{"auto", "on", "off"}};
  if (name != "method") return std::nullopt;
  std::vector<std::string> names;
  for (const physics::Method method : physics::kMethods) names.push_back(physics::name_of(method));
  return names;
}

struct NumberRule {
  const char* name;
  Within within;
  bool is_whole = false;
  const char* allowed;
};
constexpr const char *kExport = "export", *kExportRate = "export-rate";
constexpr Within kFactor{.least = 0, .most = 1e6, .without_least = true};
constexpr NumberRule kNumberRules[] = {{"corrector_effort", kFactor, false, "a number above 0 and at most 1e6"},
                                       {"corrector_horizon", kFactor, false, "a number above 0 and at most 1e6"},
                                       {"corrector_root_weight", kFactor, false, "a number above 0 and at most 1e6"},
                                       {"corrector_regulator", {.least = 0, .most = 1e6}, false, "a number from 0 to 1e6"},
                                       {"step_s", {.least = 1e-7, .most = kLongestStep}, false, "a number of seconds from 1e-7 to 1/120"},
                                       {kExportRate, {.least = kLeastExportRate, .most = kMostExportRate}, false, "a number from 1 to 240"},
                                       {"seed", {.least = 0, .most = kMostSeed}, true, "a whole number from 0 to 4294967295"}};

bool keeps(const NumberRule& rule, const Setting& value) {
  const auto* whole = std::get_if<std::int64_t>(&value);
  const auto* number = std::get_if<double>(&value);
  if (whole == nullptr && (number == nullptr || rule.is_whole)) return false;
  const double told = whole != nullptr ? static_cast<double>(*whole) : *number;
  return told >= rule.within.least && told <= rule.within.most && !(rule.within.without_least && told == rule.within.least);
}

bool has_states(const retarget::ContactSchedule& contacts, Eigen::Index points, Eigen::Index frames) {
  if (contacts.touching.rows() != points || contacts.touching.cols() != frames) return false;
  if (contacts.state.size() != contacts.patches.size()) return false;
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    if (static_cast<Eigen::Index>(contacts.state[k].size()) != frames) return false;
    for (const int point : contacts.patches[k].points) {
      if (point < 0 || point >= points) return false;
    }
  }
  return true;
}

/// Whether what target.bin holds is about the body of body.json.
bool target_fits_body(const retarget::Performer& performer) {
  const Eigen::Index nodes = performer.mesh.nodes.cols(), points = performer.contacts.vertices.size();
  const retarget::Motion& target = performer.prepared.target;
  return target.count() > 0 && target.frames.rows() == 3 * nodes && performer.muscles.fields.rows() == performer.mesh.edges.cols() &&
         performer.muscles.fields.cols() == static_cast<Eigen::Index>(performer.muscles.names.size()) &&
         performer.clip_points.count() > 0 && performer.clip_points.frames.rows() == 3 * points && performer.clip_skin.count() > 0 &&
         performer.clip_skin.frames.rows() == performer.skin.vertices.size() && has_states(performer.prepared.contacts, points, target.count());
}

bool signals_fit_body(const retarget::SignalSet& signals, const physics::Body& body) {
  return signals.nodes.cols() == body.edges.cols() && signals.nodes == body.edges;
}

/// Where there is no wobble.bin it is off, for the reason that creature.toml tells.
retarget::Wobble load_wobble(const std::filesystem::path& creature, const LoadedCreature& loaded) {
  const std::filesystem::path file = creature / "wobble.bin";
  if (std::filesystem::exists(file)) return parse_wobble(read_file(file), file.string(), loaded.target.performer);
  retarget::Wobble wobble;
  for (const CreatureRecord::Effect& effect : loaded.record.effects) {
    if (effect.name == "wobble") wobble.reason = effect.reason;
  }
  return wobble;
}

}  // namespace

LoadedCreature load_creature(const std::filesystem::path& creature) {
  if (!is_creature(creature)) throw Error(creature.string(), "", "is no creature", "Make one with 'hydrostat convert'.");
  const std::filesystem::path body_file = creature / "body.json", target_file = creature / "target.bin",
                              signals_file = creature / "signals.json", appearance_file = creature / "appearance.bin";
  LoadedCreature loaded;
  loaded.record = read_creature_record(creature);
  if (setting(loaded.record, "kind", "") == "scene") {
    throw Error(creature.string(), "", "holds a scene's simulation, not a creature", "Simulate the scene again with 'hydrostat simulate'.");
  }
  check_settings(loaded.record, (creature / "creature.toml").string());
  loaded.target = parse_target(read_file(target_file), target_file.string());
  loaded.target.performer.clip_rise = loaded.record.clip_rise_m;
  parse_body(read_file(body_file), body_file.string(), loaded.target.performer);
  loaded.signals = read_signals(signals_file);
  if (!target_fits_body(loaded.target.performer)) throw Error(target_file.string(), "", "does not belong to body.json", kMend);
  if (!signals_fit_body(loaded.signals, loaded.target.performer.scene.body)) {
    throw Error(signals_file.string(), "'channels'", "are not the constraints of body.json", kMend);
  }
  if (std::filesystem::exists(appearance_file)) {
    loaded.appearance = parse_appearance(read_file(appearance_file), appearance_file.string(),
                                         loaded.target.performer.skin.vertices.cols());
  }
  const std::filesystem::path morphs_file = creature / "morphs.bin";
  if (std::filesystem::exists(morphs_file)) {
    loaded.target.performer.morphs =
        parse_morphs(read_file(morphs_file), morphs_file.string(), loaded.target.performer.skin.vertices.cols());
  }
  const std::filesystem::path path_file = creature / "path.bin";
  if (std::filesystem::exists(path_file)) parse_path(read_file(path_file), path_file.string(), loaded.target);
  loaded.target.performer.wobble = load_wobble(creature, loaded);
  retarget::SelfContactPlan plan = retarget::plan_self_contact(loaded.target.performer);
  loaded.target.performer.scene.self_contact = std::move(plan.settings);
  loaded.target.performer.self_contact_reason = std::move(plan.reason);
  return loaded;
}

retarget::Rig load_rig(const std::filesystem::path& creature, const LoadedCreature& loaded) {
  const std::filesystem::path file = creature / "rig.bin";
  if (!std::filesystem::exists(file)) throw Error(file.string(), "", "is missing: other levels are made from it", kMend);
  const retarget::Performer& performer = loaded.target.performer;
  return parse_rig(read_file(file), file.string(), performer.mesh.node_count(), performer.skin.vertices.cols());
}

retarget::CreatureOptions level_options(const LoadedCreature& loaded) {
  const std::vector<physics::BodyElements<3>>& elements = loaded.target.performer.scene.body.elements;
  retarget::CreatureOptions options;
  options.friction = loaded.target.performer.scene.ground.friction;
  options.hexahedra = !elements.empty() && elements.front().block.is_box();
  options.material =
      elements.empty() ? retarget::BodyMaterial::kSprings : retarget::material_of(elements.front().block.law);
  for (const auto& [name, value] : loaded.record.settings) {
    if (const bool* is_on = std::get_if<bool>(&value); is_on != nullptr && name == "calibrated") options.calibrated = *is_on;
  }
  return options;
}

void check_settings(const CreatureRecord& record, const std::string& file) {
  for (const auto& [name, value] : record.settings) {
    if (name == "calibrated" && !std::holds_alternative<bool>(value)) throw setting_error(file, name, value, "true or false");
    if (const auto words = words_of(name)) {
      const auto* text = std::get_if<std::string>(&value);
      if (text == nullptr || std::find(words->begin(), words->end(), *text) == words->end()) {
        std::string all;
        for (const std::string& word : *words) all += (all.empty() ? "one of " : ", ") + word;
        throw setting_error(file, name, value, all);
      }
    }
    if (const auto* text = std::get_if<std::string>(&value); name == kExport && (text == nullptr || !exports_named(*text))) {
      throw setting_error(file, name, value, "a list of pc2, mdd and obj, in this order, with commas between,");
    }
    for (const NumberRule& rule : kNumberRules) {
      if (name == rule.name && !keeps(rule, value)) throw setting_error(file, name, value, rule.allowed);
    }
  }
}

double setting(const CreatureRecord& record, const std::string& name, double otherwise) {
  for (const auto& [key, value] : record.settings) {
    if (key != name) continue;
    if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
    if (const auto* number = std::get_if<double>(&value)) return *number;
  }
  return otherwise;
}

std::string setting(const CreatureRecord& record, const std::string& name, const std::string& otherwise) {
  for (const auto& [key, value] : record.settings) {
    if (const auto* text = std::get_if<std::string>(&value); text != nullptr && key == name) return *text;
  }
  return otherwise;
}

namespace {

/// The numbers by their names in creature.toml.
std::array<std::pair<const char*, double*>, 4> named_numbers(retarget::Feedback& feedback) {
  return {{{"corrector_effort", &feedback.effort},
           {"corrector_horizon", &feedback.horizon},
           {"corrector_root_weight", &feedback.root_weight},
           {"corrector_regulator", &feedback.regulator}}};
}

}  // namespace

retarget::Feedback feedback_of(const CreatureRecord& record) {
  retarget::Feedback feedback;
  for (const auto& [name, number] : named_numbers(feedback)) *number = setting(record, name, *number);
  return feedback;
}

void put_feedback(retarget::Feedback feedback, CreatureRecord& record) {
  retarget::Feedback usual;
  const auto numbers = named_numbers(feedback), usual_numbers = named_numbers(usual);
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const auto& [name, number] = numbers[k];
    if (*number != *usual_numbers[k].second) record.settings.emplace_back(name, *number);
  }
}

Exports exports_of(const CreatureRecord& record) {
  Exports exports = exports_named(setting(record, kExport, "")).value_or(Exports());
  exports.rate_hz = setting(record, kExportRate, exports.rate_hz);
  return exports;
}

void put_exports(const Exports& exports, CreatureRecord& record) {
  std::erase_if(record.settings, [](const auto& setting) { return setting.first == kExport || setting.first == kExportRate; });
  if (!exports.any()) return;
  record.settings.emplace_back(kExport, export_words(exports));
  record.settings.emplace_back(kExportRate, exports.rate_hz);
}

}  // namespace hydrostat::io

#include "io/creature_record.h"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <sstream>

#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io {

namespace {

constexpr const char* kRecordSchema = "hydrostat.creature/1";
constexpr const char* kMendRecord = "Make the creature again with 'hydrostat convert'.";

std::string key_text(const std::string& key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_' || letter == '-';
  });
  std::ostringstream text;
  if (bare) {
    text << key;
  } else {
    text << toml::value<std::string>(key);
  }
  return text.str();
}

/// A number as short as reads back the same, with a point or an exponent, for TOML tells 1.0 from 1.
std::string number_text(double number) {
  std::array<char, 32> digits;
  std::string text(digits.data(), std::to_chars(digits.begin(), digits.end(), number).ptr);
  return text.find_first_of(".ein") == std::string::npos ? text + ".0" : text;
}

/// One line "key = value"; toml++ knows the quoting.
template <typename Value>
void put(std::ostream& out, const std::string& key, const Value& value) {
  out << key_text(key) << " = ";
  if constexpr (std::is_same_v<Value, double>) {
    out << number_text(value) << "\n";
  } else {
    out << toml::value<Value>(value) << "\n";
  }
}

std::string where(const toml::source_region& source) { return "line " + std::to_string(source.begin.line); }

std::string text_of(const std::string& file, const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  if (node == nullptr || !node->is_string()) {
    throw Error(file, where(table.source()), "a text '" + std::string(key) + "' is missing", kMendRecord);
  }
  return **node->as_string();
}

double number_of(const std::string& file, const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  if (node == nullptr || !node->is_number()) {
    throw Error(file, where(table.source()), "a number '" + std::string(key) + "' is missing", kMendRecord);
  }
  return *node->value<double>();
}

CreatureRecord::Setting setting_of(const std::string& file, const std::string& key, const toml::node& node) {
  if (const auto* flag = node.as_boolean()) return **flag;
  if (const auto* number = node.as_integer()) return **number;
  if (const auto* number = node.as_floating_point()) return **number;
  if (const auto* text = node.as_string()) return **text;
  throw Error(file, where(node.source()), "setting '" + key + "' is neither number, text nor true or false", kMendRecord);
}

const toml::table& table_of(const std::string& file, const toml::table& root, std::string_view key) {
  const toml::table* table = root[key].as_table();
  if (table == nullptr) throw Error(file, where(root.source()), "the table [" + std::string(key) + "] is missing", kMendRecord);
  return *table;
}

}  // namespace

std::string to_toml(const CreatureRecord& record) {
  std::ostringstream out;
  out << "# What this creature is made of. Written by hydrostat.\n";
  put<std::string>(out, "schema", kRecordSchema);
  out << "\n[source]\n";
  put(out, "file", record.source_file);
  put(out, "sha256", record.source_sha256);
  put(out, "clip", record.clip);
  put(out, "clip_rise_m", record.clip_rise_m);
  out << "\n[settings]\n";
  for (const auto& [key, setting] : record.settings) {
    std::visit([&out, &name = key](const auto& value) { put(out, name, value); }, setting);
  }
  for (const CreatureRecord::Effect& effect : record.effects) {
    out << "\n[[effect]]\n";
    put(out, "name", effect.name);
    put(out, "state", effect.state);
    put(out, "reason", effect.reason);
  }
  return out.str();
}

CreatureRecord read_creature_record(const std::filesystem::path& creature) {
  const std::filesystem::path path = creature / "creature.toml";
  const std::string file = path.string();
  const std::string text = read_file(path);
  try {
    const toml::table root = toml::parse(text, file);
    const std::string schema = text_of(file, root, "schema");
    if (schema != kRecordSchema) {
      throw Error(file, where(root.get("schema")->source()), "schema is '" + schema + "', not '" + kRecordSchema + "'", kMendRecord);
    }
    const toml::table& source = table_of(file, root, "source");
    CreatureRecord record{
        text_of(file, source, "file"), text_of(file, source, "sha256"), text_of(file, source, "clip"), number_of(file, source, "clip_rise_m"), {}, {}};
    std::vector<std::pair<toml::source_position, std::pair<std::string, CreatureRecord::Setting>>> settings;
    for (const auto& [key, node] : table_of(file, root, "settings")) {
      const std::string name(key.str());
      settings.push_back({key.source().begin, {name, setting_of(file, name, node)}});
    }
    // toml++ hands keys over by alphabet; the file's order is the record's.
    std::sort(settings.begin(), settings.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [position, setting] : settings) record.settings.push_back(std::move(setting));
    if (const toml::array* effects = root["effect"].as_array()) {
      for (const toml::node& node : *effects) {
        const toml::table* effect = node.as_table();
        if (effect == nullptr) throw Error(file, where(node.source()), "an effect is not a table", kMendRecord);
        record.effects.push_back(
            {text_of(file, *effect, "name"), text_of(file, *effect, "state"), text_of(file, *effect, "reason")});
      }
    }
    return record;
  } catch (const toml::parse_error& error) {
    throw Error(file, where(error.source()), std::string(error.description()), kMendRecord);
  }
}

}  // namespace hydrostat::io

#include "io/toml_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>

#include "io/write_file.h"

namespace hydrostat::io {
namespace {

std::string at_line(const toml::node& node) { return "line " + std::to_string(node.source().begin.line); }

std::string as_text(double number) {
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.begin(), digits.end(), number).ptr};
}

const char* kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "a text";
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date";
  }
}

std::string rule_of(const Within& within) {
  std::string rule;
  if (within.least > -std::numeric_limits<double>::max()) {
    rule = (within.without_least ? "above " : "at least ") + as_text(within.least);
  }
  if (within.most < std::numeric_limits<double>::max()) {
    rule += (rule.empty() ? "" : " and ") + std::string(within.without_most ? "below " : "at most ") + as_text(within.most);
  }
  return rule.empty() ? "finite" : rule;
}

bool is_within(double number, const Within& within) {
  return std::isfinite(number) && number >= within.least && number <= within.most &&
         !(within.without_least && number == within.least) && !(within.without_most && number == within.most);
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

/// Levenshtein's distance.
std::size_t changes_between(const std::string& one, const std::string& other) {
  std::vector<std::size_t> row(other.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < one.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < other.size(); ++j) {
      const std::size_t replaced = diagonal + (one[i] == other[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// A key without its unit: without what of at most three letters stands behind underscores at its end.
std::string without_unit(std::string key) {
  for (std::size_t at = key.rfind('_'); at != std::string::npos && at > 0 && key.size() - at <= 4; at = key.rfind('_')) key.resize(at);
  return key;
}

/// Whether a key means the other one in another unit, or without any.
bool is_in_another_unit(const std::string& key, const std::string& other) {
  const std::string quantity = without_unit(other);
  return key == quantity || key.starts_with(quantity + "_");
}

}  // namespace

std::string nearest_word(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t least = word.size() / 2 + 1;
  for (const std::string& other : known) {
    // What lacks its unit or its first word, or has one too many, means the one that is alike otherwise.
    const auto lacks_a_word = [](const std::string& part, const std::string& whole) {
      return part.size() > 3 && (whole.starts_with(part + "_") || whole.ends_with("_" + part));
    };
    const std::size_t changes = lacks_a_word(word, other) || lacks_a_word(other, word) ? 1 : changes_between(word, other);
    if (changes < least) nearest = other, least = changes;
  }
  return nearest;
}

toml::table parse_toml(const std::filesystem::path& file) {
  const std::string text = read_file(file);
  try {
    return toml::parse(text, file.string());
  } catch (const toml::parse_error& error) {
    throw Error(file.string(), "line " + std::to_string(error.source().begin.line), std::string(error.description()),
                "Mend the TOML of that line.");
  }
}

TomlReader::TomlReader(const toml::table& table, const std::filesystem::path& file, std::string name)
    : table_(&table), file_(&file), name_(std::move(name)) {}

std::string TomlReader::named(const std::string& key) const { return "'" + key + "'" + (name_.empty() ? "" : " of " + name_); }

const toml::node* TomlReader::find(const std::string& key) const {
  asked_.insert(key);
  return table_->get(key);
}

bool TomlReader::has(const std::string& key) const { return find(key) != nullptr; }

const toml::node& TomlReader::need(const std::string& key) const {
  const toml::node* node = find(key);
  if (node != nullptr) return *node;
  for (const auto& [other, value] : *table_) {
    const std::string word(other.str());
    if (!asked_.contains(word) && is_in_another_unit(word, key)) throw not_known(other, {key});
  }
  throw refusal(key, named(key) + " is missing", "Add " + key + " = ...");
}

Error TomlReader::refusal(const std::string& key, const std::string& what, const std::string& mend) const {
  const toml::node* node = table_->get(key);
  const toml::node& place = node == nullptr ? static_cast<const toml::node&>(*table_) : *node;
  return {file_->string(), place.source().begin.line == 0 ? "" : at_line(place), what, mend};
}

double TomlReader::number_in(const std::string& key, const toml::node& node, const Within& within) const {
  if (!node.is_number()) {
    throw Error(file_->string(), at_line(node), named(key) + " is " + kind_of(node) + " where a number belongs",
                "Give a number that is " + rule_of(within) + ".");
  }
  const double number = *node.value<double>();
  if (!is_within(number, within)) {
    throw Error(file_->string(), at_line(node), named(key) + " is " + as_text(number), "Give a number that is " + rule_of(within) + ".");
  }
  return number;
}

double TomlReader::number(const std::string& key, const Within& within) const { return number_in(key, need(key), within); }

double TomlReader::number_or(const std::string& key, double otherwise, const Within& within) const {
  return has(key) ? number(key, within) : otherwise;
}

long TomlReader::whole_or(const std::string& key, long otherwise, long least, long most) const {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  const auto* whole = node->as_integer();
  if (whole == nullptr || **whole < least || **whole > most) {
    throw refusal(key, named(key) + " is no whole number from " + std::to_string(least) + " to " + std::to_string(most),
                  "Give one within.");
  }
  return static_cast<long>(**whole);
}

bool TomlReader::flag_or(const std::string& key, bool otherwise) const {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  const auto* flag = node->as_boolean();
  if (flag == nullptr) throw refusal(key, named(key) + " is " + kind_of(*node) + ", not true or false", "Give true or false.");
  return **flag;
}

std::string TomlReader::text(const std::string& key) const {
  const toml::node& node = need(key);
  const auto* text = node.as_string();
  if (text == nullptr) throw refusal(key, named(key) + " is " + kind_of(node) + " where a text belongs", "Write it in quotes.");
  return **text;
}

std::string TomlReader::choice(const std::string& key, const std::vector<std::string>& choices) const {
  const std::string word = text(key);
  if (std::find(choices.begin(), choices.end(), word) != choices.end()) return word;
  const std::string nearest = nearest_word(word, choices);
  throw refusal(key, named(key) + " is '" + word + "', which is none of " + joined(choices),
                nearest.empty() ? "Give one of these." : "Did you mean '" + nearest + "'?");
}

std::string TomlReader::choice_or_first(const std::string& key, const std::vector<std::string>& choices) const {
  return has(key) ? choice(key, choices) : choices.front();
}

Eigen::VectorXd TomlReader::numbers(const std::string& key, Eigen::Index count, const Within& within) const {
  const toml::node& node = need(key);
  const toml::array* list = node.as_array();
  if (list == nullptr || static_cast<Eigen::Index>(list->size()) != count) {
    throw refusal(key, named(key) + " is not a list of " + std::to_string(count) + " numbers",
                  "Write it like " + key + " = [" + (count == 2 ? "0.0, 1.0" : "0.0, 1.0, 0.0") + "].");
  }
  Eigen::VectorXd values(count);
  for (Eigen::Index k = 0; k < count; ++k) values[k] = number_in(key, *list->get(static_cast<std::size_t>(k)), within);
  return values;
}

Eigen::VectorXd TomlReader::numbers_or(const std::string& key, const Eigen::VectorXd& otherwise, const Within& within) const {
  return has(key) ? numbers(key, otherwise.size(), within) : otherwise;
}

Eigen::VectorXd TomlReader::number_or_numbers(const std::string& key, Eigen::Index count, const Within& within) const {
  const toml::node& node = need(key);
  if (node.is_array()) return numbers(key, count, within);
  return Eigen::VectorXd::Constant(count, number_in(key, node, within));
}

Eigen::MatrixXd TomlReader::lists(const std::string& key, Eigen::Index rows, const Within& within) const {
  const toml::array* list = need(key).as_array();
  const std::string form = "Write it like " + key + " = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].";
  if (list == nullptr) throw refusal(key, named(key) + " is not a list", form);
  Eigen::MatrixXd values(rows, static_cast<Eigen::Index>(list->size()));
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    const toml::node& node = *list->get(static_cast<std::size_t>(c));
    const toml::array* column = node.as_array();
    if (column == nullptr || static_cast<Eigen::Index>(column->size()) != rows) {
      throw Error(file_->string(), at_line(node), named(key) + " holds something that is no list of " + std::to_string(rows) + " numbers", form);
    }
    for (Eigen::Index r = 0; r < rows; ++r) values(r, c) = number_in(key, *column->get(static_cast<std::size_t>(r)), within);
  }
  return values;
}

std::optional<TomlReader> TomlReader::table(const std::string& key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const toml::table* table = node->as_table();
  if (table == nullptr) {
    throw refusal(key, "'" + key + "' is " + kind_of(*node) + " where a table belongs", "Write [" + key + "] on a line of its own.");
  }
  return TomlReader(*table, *file_, "[" + key + "]");
}

std::vector<TomlReader> TomlReader::tables(const std::string& key) const {
  const toml::node* node = find(key);
  std::vector<TomlReader> result;
  if (node == nullptr) return result;
  const toml::array* list = node->as_array();
  const std::string mend = "Write [[" + key + "]] on a line of its own for each.";
  if (list == nullptr) throw refusal(key, "'" + key + "' is " + kind_of(*node) + " where a list of tables belongs", mend);
  for (const toml::node& entry : *list) {
    const toml::table* table = entry.as_table();
    if (table == nullptr) throw Error(file_->string(), at_line(entry), "'" + key + "' holds " + kind_of(entry) + " where a table belongs", mend);
    result.emplace_back(*table, *file_, "[[" + key + "]]");
  }
  return result;
}

Error TomlReader::not_known(const toml::key& key, const std::vector<std::string>& known) const {
  const std::string word(key.str());
  const auto alike = std::find_if(known.begin(), known.end(), [&](const std::string& other) { return is_in_another_unit(word, other); });
  const std::string nearest = alike != known.end() ? *alike : nearest_word(word, known);
  return {file_->string(), "line " + std::to_string(key.source().begin.line), named(word) + " is not known here",
          nearest.empty() ? "Known are " + joined(known) + "." : "Did you mean '" + nearest + "'?"};
}

void TomlReader::refuse_others() const {
  for (const auto& [key, node] : *table_) {
    if (!asked_.contains(std::string(key.str()))) throw not_known(key, {asked_.begin(), asked_.end()});
  }
}

}  // namespace hydrostat::io

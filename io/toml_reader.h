#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "retarget/error.h"

namespace hydrostat::io {

/// Parses a TOML file. Throws Error with the line where it is no TOML, without one where it cannot be read.
toml::table parse_toml(const std::filesystem::path& file);

/// What a number may be.
struct Within {
  double least = -std::numeric_limits<double>::max(), most = std::numeric_limits<double>::max();
  bool without_least = false, without_most = false;  // the bound itself is out
};
constexpr Within kAny{};
constexpr Within kAboveZero{.least = 0, .without_least = true};
constexpr Within kNotNegative{.least = 0};
constexpr Within kLength{.least = 1e-6, .most = 1e6};   // [m]
constexpr Within kPlace{.least = -1e7, .most = 1e7};    // [m], a coordinate

/// One table of a TOML file, read strictly: every value has its type and range, and no key is left over. All refusals are
/// Errors that name file and line.
class TomlReader {
 public:
  /// `name` is what messages call the table: "[body]". Table and file must outlive the reader.
  TomlReader(const toml::table& table, const std::filesystem::path& file, std::string name);

  bool has(const std::string& key) const;
  double number(const std::string& key, const Within& within = kAny) const;
  double number_or(const std::string& key, double otherwise, const Within& within = kAny) const;
  long whole_or(const std::string& key, long otherwise, long least, long most) const;
  bool flag_or(const std::string& key, bool otherwise) const;
  std::string text(const std::string& key) const;
  /// One of `choices`; the first where the key is missing.
  std::string choice_or_first(const std::string& key, const std::vector<std::string>& choices) const;
  std::string choice(const std::string& key, const std::vector<std::string>& choices) const;
  /// As many numbers as `count`.
  Eigen::VectorXd numbers(const std::string& key, Eigen::Index count, const Within& within = kAny) const;
  Eigen::VectorXd numbers_or(const std::string& key, const Eigen::VectorXd& otherwise, const Within& within = kAny) const;
  /// The same, or one number for all of them.
  Eigen::VectorXd number_or_numbers(const std::string& key, Eigen::Index count, const Within& within = kAny) const;
  /// Lists of `rows` numbers each, as columns.
  Eigen::MatrixXd lists(const std::string& key, Eigen::Index rows, const Within& within = kAny) const;
  /// A table below this one; nothing where it is missing.
  std::optional<TomlReader> table(const std::string& key) const;
  /// An array of tables ([[obstacle]]); empty where it is missing.
  std::vector<TomlReader> tables(const std::string& key) const;

  /// Refuses a key that nobody has asked for, and names the nearest that somebody has.
  void refuse_others() const;
  /// An Error at the line of the key, or of the table where it has none.
  Error refusal(const std::string& key, const std::string& what, const std::string& mend) const;
  const std::filesystem::path& file() const { return *file_; }

 private:
  const toml::node* find(const std::string& key) const;
  const toml::node& need(const std::string& key) const;
  Error not_known(const toml::key& key, const std::vector<std::string>& known) const;
  double number_in(const std::string& key, const toml::node& node, const Within& within) const;
  std::string named(const std::string& key) const;

  const toml::table* table_;
  const std::filesystem::path* file_;
  std::string name_;
  mutable std::set<std::string> asked_;
};

/// The word of `known` that takes the fewest letters changed, put in or left out to become `word`; empty where that is more than
/// half of its letters.
std::string nearest_word(const std::string& word, const std::vector<std::string>& known);

}  // namespace hydrostat::io

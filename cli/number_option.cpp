#include "cli/number_option.h"

#include <charconv>
#include <cstdio>
#include <optional>

#include "retarget/error.h"

namespace hydrostat::cli {
namespace {

std::optional<double> number_in(const std::string& text, double least, double most) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size() || !(least <= value && value <= most)) return std::nullopt;
  return value;
}

std::string complaint(const std::string& text, double least, double most) {
  char range[80];
  std::snprintf(range, sizeof range, " not in range %g to %g", least, most);
  return "Value " + text + range;
}

}  // namespace

CLI::Validator number_within(double least, double most) {
  char name[60];
  std::snprintf(name, sizeof name, "%g to %g", least, most);
  return CLI::Validator([least, most](std::string& text) { return number_in(text, least, most) ? "" : complaint(text, least, most); },
                        name);
}

double parse_number(const std::string& text, double least, double most, const std::string& command, const std::string& option) {
  const std::optional<double> value = number_in(text, least, most);
  if (!value) throw UsageError(command, "option " + option, complaint(text, least, most), "'" + command + " --help' tells what it takes.");
  return *value;
}

double parse_share(const std::string& text, const std::string& command, const std::string& option) {
  constexpr double kLeast = 1e-7, kMost = 0.5;
  if (!text.ends_with('%')) return parse_number(text, kLeast, kMost, command, option);
  return parse_number(text.substr(0, text.size() - 1), 100 * kLeast, 100 * kMost, command, option) / 100;
}

}  // namespace hydrostat::cli

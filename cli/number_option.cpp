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

/// What stands before a unit, which may be left out and may have a space before it.
std::string before_unit(const std::string& text, const std::string& unit) {
  if (!text.ends_with(unit)) return text;
  const std::size_t last = text.substr(0, text.size() - unit.size()).find_last_not_of(' ');
  return text.substr(0, last == std::string::npos ? 0 : last + 1);
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

double parse_milliseconds(const std::string& text, double least, double most, const std::string& command, const std::string& option) {
  const std::optional<double> value = number_in(before_unit(text, "ms"), least, most);
  if (value) return *value;
  char range[80];
  std::snprintf(range, sizeof range, "' is no time from %g to %g ms", least, most);
  throw UsageError(command, "option " + option, "'" + text + range, "Write it like 2ms.");
}

double parse_share(const std::string& text, const std::string& command, const std::string& option) {
  constexpr double kLeast = 1e-7, kMost = 0.5;
  const double unit = text.ends_with('%') ? 100 : 1;
  const std::optional<double> value = number_in(before_unit(text, "%"), unit * kLeast, unit * kMost);
  if (value) return *value / unit;
  char range[160];
  std::snprintf(range, sizeof range, "' is no share of L from %g to %g, or from %.5f%% to %g%%", kLeast, kMost, 100 * kLeast, 100 * kMost);
  throw UsageError(command, "option " + option, "'" + text + range, "Write it like 1% or 0.01.");
}

}  // namespace hydrostat::cli

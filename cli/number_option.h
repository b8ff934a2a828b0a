#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace hydrostat::cli {

/// Lets a finite number within [least, most] pass. CLI11's own range lets NaN through.
CLI::Validator number_within(double least, double most);

/// A number that must be finite and within [least, most]. `command` and `option` are what the UsageError names otherwise.
double parse_number(const std::string& text, double least, double most, const std::string& command, const std::string& option);

/// Milliseconds within [least, most], as "2ms", "2 ms" or "2". What is none is a UsageError.
double parse_milliseconds(const std::string& text, double least, double most, const std::string& command, const std::string& option);

/// A share of L above 0 and at most a half, as "1%", "1 %" or "0.01". What is none is a UsageError.
double parse_share(const std::string& text, const std::string& command, const std::string& option);

}  // namespace hydrostat::cli

#pragma once

#include <string>

namespace hydrostat::cli {

/// Complains of an option for a file or directory that is empty or holds the next option, whose own place was forgotten.
inline std::string refuse_no_place(const std::string& text) {
  if (text.empty()) return "is empty where a path belongs";
  return text.starts_with('-') ? "'" + text + "' is an option where a path belongs (a file of that name is ./" + text + ")" : "";
}

}  // namespace hydrostat::cli

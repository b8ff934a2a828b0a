#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace hydrostat::retarget {

/// As printf has it; what is beyond 499 characters is cut.
template <typename... Numbers>
std::string sentence(const char* form, Numbers... numbers) {
  std::array<char, 500> text;
  std::snprintf(text.data(), text.size(), form, numbers...);
  return text.data();
}

}  // namespace hydrostat::retarget

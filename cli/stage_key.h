#pragma once

#include <string>

#include "io/fingerprint.h"

namespace hydrostat::cli {

/// The key of a stage: all that the stage before depends on, and what this one adds.
template <typename... Values>
std::string key_after(const std::string& before, const Values&... values) {
  io::Fingerprint fingerprint;
  fingerprint.add("before", before);
  (fingerprint.add("value", values), ...);
  return fingerprint.hex();
}

}  // namespace hydrostat::cli

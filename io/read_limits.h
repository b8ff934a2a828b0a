#pragma once

namespace hydrostat::io {

/// What reading one clip file may take before it is refused.
struct ReadLimits {
  double time_s = 30;     // by the clock, from the start of the reading process to the last box of 'info'
  double memory_gib = 2;  // of the reading process's address space [2^30 bytes]; not held to under a sanitizer
};

}  // namespace hydrostat::io

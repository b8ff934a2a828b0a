#pragma once

#include <string>
#include <vector>

#include "retarget/scaling.h"

namespace hydrostat::io {

/// What 'hydrostat bench scaling' found.
struct ScalingReport {
  std::string scene, method;  // the scene's file, or "bar"; the method's name
  int threads = 2;            // of the shared measurement
  std::vector<retarget::ScalingRow> rows;
  retarget::MachineLimits machine;
};

/// The time [ns] that an element and substep takes at least, by memory and by arithmetic; 0 where nothing was counted.
double memory_limit_ns(const ScalingReport& report, const retarget::ScalingRow& row);
double arithmetic_limit_ns(const ScalingReport& report, const retarget::ScalingRow& row);

/// A table with a header, one line a body.
std::string scaling_csv(const ScalingReport& report);
/// One page that needs nothing else: curves over the number of elements, the table, and the machine's limits in words.
std::string scaling_page(const ScalingReport& report);
/// Schema "hydrostat.scaling/1".
std::string scaling_json(const ScalingReport& report);

}  // namespace hydrostat::io

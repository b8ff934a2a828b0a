#pragma once

#include <algorithm>

#include "retarget/corrector.h"

namespace hydrostat::retarget {

/// How feedback differs from the usual: factors on what the corrector is given, and how far a regulator goes in its place.
struct Feedback {
  double effort = 1, horizon = 1, root_weight = 1;
  double regulator = 0;  // its reach; 0: there is none
  bool operator==(const Feedback&) const = default;
};

/// The options with such feedback.
inline CorrectorOptions with(const Feedback& feedback, const CorrectorOptions& options) {
  CorrectorOptions result = options;
  result.effort *= feedback.effort;
  result.horizon_s *= feedback.horizon;
  result.root_weight *= feedback.root_weight;
  result.regulator.reach = std::max(result.regulator.reach, feedback.regulator);
  return result;
}

}  // namespace hydrostat::retarget

#pragma once

#include "retarget/corrector.h"

namespace hydrostat::retarget {

/// How feedback differs from the usual: factors on what the corrector is given.
struct Feedback {
  double effort = 1, horizon = 1, root_weight = 1;
  bool operator==(const Feedback&) const = default;
};

/// The options with such feedback.
inline CorrectorOptions with(const Feedback& feedback, const CorrectorOptions& options) {
  CorrectorOptions result = options;
  result.effort *= feedback.effort;
  result.horizon_s *= feedback.horizon;
  result.root_weight *= feedback.root_weight;
  return result;
}

}  // namespace hydrostat::retarget

#include "retarget/firm_plan.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kFirm = 10, kFootSettle = 0.5, kStep = 1.3;  // at that firmness and beyond, times the usual

}  // namespace

CorrectorOptions gain_of_firm_plan(const PreparedTarget& plan, const CorrectorOptions& options) {
  CorrectorOptions result = options;
  const double share = std::clamp(std::log(plan.firmness) / std::log(kFirm), 0.0, 1.0);
  if (share == 0) return result;
  result.foot_settle_s *= std::pow(kFootSettle, share);
  result.step *= std::pow(kStep, share);
  return result;
}

}  // namespace hydrostat::retarget

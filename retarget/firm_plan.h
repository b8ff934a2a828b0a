#pragma once

#include "retarget/corrector.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// The options by which a plan is corrected that holds on to the clip's shape more firmly than the usual. Its feet lift higher, so that none
/// drags along the ground and bears by chance when the body is off; those in the air have to be where they can bear it sooner, and a little
/// further, in proportion to the firmness' logarithm up to 10. Factors measured on the fox's walk.
CorrectorOptions gain_of_firm_plan(const PreparedTarget& plan, const CorrectorOptions& options);

}  // namespace hydrostat::retarget

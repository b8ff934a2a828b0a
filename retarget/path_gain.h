#pragma once

#include "retarget/nominal_path.h"
#include "retarget/replay.h"

namespace hydrostat::retarget {

/// The options by which a plan is corrected. What drags its trunk, and has no legs, lies on a broad base and does not fall of itself; it
/// slips and sticks by turns, which the corrector's model foresees badly, and a gain that legs need rolls it until it tips over. So it is
/// corrected at far more effort.
///
/// Feedback is calm while the error is small. A path that was learned lies beside the target, and the loop was stable there at the
/// gain that the distance to the target gave it: now that this distance is no error any more, that gain is kept.
CorrectorOptions gain_on_path(const ReplayInput& input, const CorrectorOptions& options);

}  // namespace hydrostat::retarget

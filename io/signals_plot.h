#pragma once

#include <string>
#include <vector>

#include "retarget/signal_set.h"

namespace hydrostat::io {

/// A drawing (SVG text, needs nothing beside it) of activations over one period: a panel a bone, its channels as lines, with
/// their layers and within the limits in blue, as solved in grey below, the limits dashed. `bones` names the channels to
/// draw.
std::string signals_plot(const retarget::SignalSet& set, const retarget::EditedActivations& edited,
                         const std::vector<retarget::BoneSignals>& bones);

}  // namespace hydrostat::io

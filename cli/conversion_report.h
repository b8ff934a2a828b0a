#pragma once

#include <optional>

#include "cli/asked_accuracy.h"
#include "cli/convert_options.h"
#include "io/creature_record.h"
#include "retarget/creature.h"
#include "retarget/performance.h"
#include "retarget/run_report.h"

namespace hydrostat::cli {

retarget::SourceReport source_report(const ConvertOptions& options, const retarget::Creature& creature,
                                     const retarget::ImportedMotion& motion);

retarget::BodyReport body_report(const retarget::Creature& creature);

/// What creature.toml keeps of a conversion.
io::CreatureRecord creature_record(const ConvertOptions& options, const retarget::Performer& performer, const retarget::RunReport& report,
                                   const std::optional<ChosenStep>& chosen, const retarget::Feedback& feedback, const retarget::CreatureOptions& settings);

/// `before` and `after` have an open loop.
retarget::PolishReport polish_report(int rounds, const retarget::Performances& before, const retarget::Performances& after);

}  // namespace hydrostat::cli

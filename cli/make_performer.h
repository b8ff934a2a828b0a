#pragma once

#include <string>

#include "retarget/creature.h"
#include "retarget/performance.h"

namespace hydrostat::cli {

/// The target that the creature is to move by, with what touches the ground and which of it are legs.
retarget::PreparedTarget prepared_target(const retarget::Creature& creature, const retarget::ImportedMotion& motion,
                                         const retarget::CreatureOptions& options);

/// The creature as its replays need it; self-contact is planned.
retarget::Performer make_performer(const retarget::Creature& creature, const retarget::ImportedMotion& motion,
                                   retarget::PreparedTarget prepared);

/// The signals of solved activations. Throws Error (`file`, clip '`clip`') for a clip that is too short.
retarget::SignalSet solved_signals(const retarget::InverseDynamics& inverse, const retarget::Performer& performer,
                                   const std::string& file, const std::string& clip);

}  // namespace hydrostat::cli

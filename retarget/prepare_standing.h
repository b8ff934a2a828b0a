#pragma once

#include "retarget/creature.h"

namespace hydrostat::retarget {

/// The creature's target. Where balance would move it by more than 4 % of L and the body hangs over its feet (static_balance.h), it is
/// prepared with less mass there, and that is kept where it halves the shift: `mass_shares` of the result, a warning tells it, and
/// `lighten` makes the body so. Of `options` it reads those of the preparation.
PreparedTarget prepare_standing(const Creature& creature, const ImportedMotion& imported, const CreatureOptions& options);

void lighten(const PreparedTarget& prepared, physics::Body& body);

}  // namespace hydrostat::retarget

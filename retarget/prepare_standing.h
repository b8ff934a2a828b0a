#pragma once

#include "retarget/creature.h"

namespace hydrostat::retarget {

/// The creature's target. Where balance would move it by more than 4 % of L and the body hangs over its feet (static_balance.h), it is
/// prepared with less mass there, and that is kept where it halves the shift: `mass_shares` of the result. Where its weight lets it sink by
/// more than kMostSag (sag.h), it is to be stiffer: `stiffness`. A warning tells either. Of `options` it reads those of the preparation.
PreparedTarget prepare_standing(const Creature& creature, const ImportedMotion& imported, const CreatureOptions& options);

/// Makes the usual body, once, as light and as stiff as its plan wants it.
void fit_body(const PreparedTarget& prepared, physics::Body& body);

}  // namespace hydrostat::retarget

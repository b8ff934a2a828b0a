#pragma once

#include "retarget/body_parts.h"

namespace hydrostat::retarget {

/// Joins all face-connected pieces of the kept parts into one, the lightest first, by the cheapest cells between: links and
/// merges are added, and parts for the cells between, the fuller the cheaper. A piece that is farther away than it is large
/// is dropped. Returns the number of cells added.
int join_pieces(const Grid& cells, BodyParts& body);

}  // namespace hydrostat::retarget

#pragma once

#include "io/report_page.h"
#include "physics/obstacle.h"

namespace hydrostat::io {

/// An obstacle as the page shows it, for a body of length `length` [m]; `travel` 3 x F [m], from where it starts. In 2D it is a slab.
template <int Dim>
PageObstacle page_obstacle(const physics::ObstacleOf<Dim>& obstacle, const retarget::Motion& travel, double length);

}  // namespace hydrostat::io

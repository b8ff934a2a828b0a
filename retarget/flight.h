#pragma once

#include <string>
#include <vector>

#include "retarget/contacts.h"

namespace hydrostat::retarget {

/// A stretch of a motion without contact, as the motion has it and as free fall would.
struct Flight {
  // Frames: the last with contact before it, the first after it; of a loop the end may lie in the next period.
  Eigen::Index start = 0, end = 0;
  double seconds = 0;      // from `start` to `end`
  double rise_m = 0;       // greatest height of the centre of mass over the straight line from start to end
  double free_fall_m = 0;  // the same of a body that falls freely for as long: g T^2 / 8
};

/// The flights between two contacts. `com_path` [m] 3 x F is the centre of mass of `motion`, `gravity` [m/s2] > 0 its pull.
std::vector<Flight> flights(const ContactSchedule& contacts, const Motion& motion,
                            const Eigen::Ref<const Eigen::Matrix3Xd>& com_path, double gravity);

/// One sentence for the flight whose rise is furthest from free fall, if it is far: with the height of the bind pose at which the two
/// agree and the time that the rise takes. `height` [m] is the bind pose's now, `length` [m] is L.
std::vector<std::string> flight_warnings(const std::vector<Flight>& flights, double rate_hz, double height, double length);

}  // namespace hydrostat::retarget

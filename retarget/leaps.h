#pragma once

#include <vector>

#include "retarget/corrector.h"
#include "retarget/prepare.h"
#include "retarget/shape_projection.h"

namespace hydrostat::retarget {

inline constexpr double kLeap = 0.05;  // [s] in the air: less is a flicker of contacts

/// Whether a frame lies in a flight: for kLeap or longer nothing touches. F.
std::vector<bool> frames_in_flight(const ContactSchedule& contacts, double rate_hz, bool loop);

/// Lets every stance last `frames` longer at both ends, as far as its patch was off the ground there, on the place on which it stands:
/// what pushes off later and lands earlier flies for a shorter time, and lower. A foot that comes down still moves, and friction brakes it
/// as much as it can: in the frames before its stance it slides, the way that it came. `points` is the motion of the contact
/// points, `holds` are find_holds' of `contacts`; both grow by those frames.
void prolong_stances(const Motion& points, long frames, ContactSchedule& contacts, std::vector<std::vector<Hold>>& holds);

/// Whether a patch that is off the ground in a frame, or in the midst of a stance, touches next without a flight before: patches x F. What
/// is to fly first is no foot that could step under the body. All true where nothing flies.
std::vector<std::vector<bool>> steps_next(const ContactSchedule& contacts, double rate_hz, bool loop);

/// Whether anything of the plan flies.
bool has_flight(const PreparedTarget& plan);

/// Feedback for a plan that flies; any other's is as it was. A foot that a landing shakes loose is wanted back on its place rather than
/// under the body, so that the rows of feet in the air weigh an eighth; the horizon is half as long again. A loop has the next hop to make
/// up for an error of momentum, and the moment of its push is too short to do so at once: these rows weigh half and the shape's three times;
/// no foot hastens to catch it, and muscles cost more: a frog's hop that keeps itself up without feedback falls on more bodies with the usual
/// gain (measured, +-10 %). What is played once has to stand where it lands, and lands turned a little: its errors of place are to be gone
/// in 0.4 of the time, before its feet stand firm.
CorrectorOptions gain_of_leaps(const PreparedTarget& plan, const CorrectorOptions& options);

}  // namespace hydrostat::retarget

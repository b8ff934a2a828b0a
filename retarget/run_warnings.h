#pragma once

#include <string>
#include <vector>

#include "retarget/performance.h"
#include "retarget/polish.h"

namespace hydrostat::retarget {

/// One sentence for each thing that an animator should know about a target: what it lacks (with time, frame and patch), and whether
/// its constraints fit the limit of |activation - 1|.
std::vector<std::string> target_warnings(const PreparedTarget& prepared, const physics::Body& body, double limit,
                                         bool limit_is_automatic);

/// The same about what the inverse dynamics found.
std::vector<std::string> inverse_warnings(const InverseReport& inverse);

/// As what the creature of such a run does: "falls", "loses its way", or its place where its clip has none to go.
std::string in_words(Lapse lapse, const ReplayReport& run);

/// Which feedback took the place of what was wished (perform_steadily) and why, or that a creature loses its way on any; none where what
/// was wished will do, nor of a fall, which is told elsewhere.
std::vector<std::string> feedback_warnings(const Performances& performances, const Feedback& wished = {});

/// m g from which an assist (external_assist_mg) is none of rounding.
constexpr double kAssist = 1e-6;
/// Whether something else than the creature's own forces and the world's had a hand in a run.
bool is_assisted(const ReplayReport& run);

bool is_assisted(const SimulationReport& run);

/// What the figures of the main run say against it: that it was assisted, or that its skin is far from the clip's. A fall is told elsewhere.
std::vector<std::string> motion_warnings(const ReplayReport& run);
/// The same of a scene's simulation, which has no clip.
std::vector<std::string> motion_warnings(const SimulationReport& run);

/// Of polished signals that were left out, for bodies off the plan are lost or stray by them or nothing was learned.
std::vector<std::string> polish_warnings(const Polished& polished);
/// What the whole replays by polished signals say against them beside those before; none where they are to be kept. How much is corrected, and
/// how far the shape is from the target, tells something only of what goes as it was planned: nothing pushes it, and the body is no other.
std::vector<std::string> polished_replay_warnings(const Performances& before, const Performances& after, bool is_as_planned);

}  // namespace hydrostat::retarget

#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "physics/contact.h"
#include "retarget/motion.h"

namespace hydrostat::retarget {

/// What a patch of skin does on the ground: it holds, it is dragged while it bears weight, or it is away.
enum class ContactState : char { kOff, kStick, kSlide };

/// Contact points that touch and leave together: those of one bone.
struct Patch {
  std::string name;         // of the bone
  std::vector<int> points;  // indices of contact points
  bool on_leg = false;      // on a limb of its own, that can step; see find_legs
};

struct ContactSchedule {
  std::vector<Patch> patches;                         // only those that ever touch
  std::vector<std::vector<ContactState>> state;       // patches x F
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> touching;  // contact points x F: bears load in that frame
  Eigen::MatrixXd sliding_x, sliding_z;  // patches x F: direction of sliding times the share of friction that it settles, 0 to 1

  double flight_s(double rate_hz) const;  // frames without any contact
};

/// Whether the plan drags what bears load: some patch slides for two frames or more, for a foot that lands slides for one.
bool is_dragged(const ContactSchedule& contacts);

struct ContactOptions {
  double height = 0.03;        // per D: a patch touches below this
  double hysteresis = 1.5;     // on height, while it touches
  double load_height = 0.03;   // per D above the patch's lowest point: what lies higher bears no load
  double still_speed = 0.15;   // of the RMS speed of all points: slower, to the frame before or after, sticks
  double least_still_speed = 0.02;  // of sqrt(g L)
  double fall_speed = 0.12;    // of sqrt(g L): a patch that rises or sinks faster does not touch
  double support_height = 0.05;  // of L: a patch bears below this where nothing touches and the body does not fall
  int least_frames = 4;        // shorter contacts and gaps are closed
};

/// Labels for the points' motion (height above the ground y = 0). Frames without contact in which the points' mean height does
/// not fall freely are no flight: the lowest and slowest patch bears there, see support_height. `bone_of_point` names each point's patch.
/// length [m] is L, size [m] is D.
///
/// Of each pair of `mirrored` bones (mirror.h) that rise and sink together, as the hind legs of what hops, both touch where
/// either does. What hovers near a limit else touches on one side alone, and a leap with one shin down turns. What
/// drags anything over the ground is left alone.
ContactSchedule label_contacts(const Motion& points, const std::vector<int>& bone_of_point,
                               const std::vector<std::string>& bone_names, double length, double size,
                               const ContactOptions& options, const std::vector<std::array<int, 2>>& mirrored = {});

/// Height [m] of the ground under a motion: the level on which its lowest points rest, the 20th percentile over the frames
/// of the lowest point.
double ground_height(const Motion& points);

inline constexpr double kTouching = 0.003;  // per D: points of a contact that ended higher bear no load

/// Marks as touching the points of patches in contact that lie lower than `height` [m] in `points`, at least the lowest.
void mark_touching(const Motion& points, double height, ContactSchedule& schedule);

/// The motion of contact points carried by nodes.
Motion point_motion(const physics::ContactPoints& points, const Motion& nodes);

}  // namespace hydrostat::retarget

#include "retarget/let_go.h"

#include <cmath>

namespace hydrostat::retarget {
namespace {

/// Mean speed [m/s] sideways, to the next frame, of the points of patch k that touch in frame f; 0 where none does.
double leaving_speed(const Motion& points, const Eigen::MatrixXd& padded, const ContactSchedule& contacts, std::size_t k, Eigen::Index f) {
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  int count = 0;
  for (const int p : contacts.patches[k].points) {
    if (!contacts.touching(p, f)) continue;
    step += (padded.col(f + 2) - padded.col(f + 1)).segment<3>(3 * p);
    ++count;
  }
  return count > 0 ? std::hypot(step.x(), step.z()) / count * points.rate_hz : 0;
}

}  // namespace

void let_go(const Motion& points, double speed, ContactSchedule& contacts) {
  const Eigen::MatrixXd padded = padded_frames(points, 1);
  for (Eigen::Index f = 0; f < points.count(); ++f) {
    const auto frame = static_cast<std::size_t>(f);
    std::vector<std::size_t> leaving;
    bool does_another_stay = false;
    for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
      if (contacts.state[k][frame] == ContactState::kOff) continue;
      const bool leaves = contacts.state[k][frame] == ContactState::kStick && leaving_speed(points, padded, contacts, k, f) > speed;
      if (leaves) leaving.push_back(k);
      else does_another_stay = true;
    }
    if (!does_another_stay) continue;
    for (const std::size_t k : leaving) {
      contacts.state[k][frame] = ContactState::kOff;
      for (const int p : contacts.patches[k].points) contacts.touching(p, f) = false;
    }
  }
}

}  // namespace hydrostat::retarget

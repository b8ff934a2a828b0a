#include "retarget/planned_contacts.h"

#include <algorithm>

#include "retarget/leaps.h"

namespace hydrostat::retarget {

PlannedContacts::PlannedContacts(const PreparedTarget& plan)
    : plan_(plan), steps_next_(steps_next(plan.contacts, plan.target.rate_hz, plan.target.loop)) {}

ContactNow PlannedContacts::first() const {
  const Eigen::Index points = plan_.contacts.touching.rows();
  ContactNow now;
  now.touching.resize(static_cast<std::size_t>(points), ContactState::kOff);
  now.bearing.resize(now.touching.size(), false);
  now.on_leg.resize(now.touching.size(), false);
  for (const Patch& patch : plan_.contacts.patches) {
    for (const int p : patch.points) now.on_leg[static_cast<std::size_t>(p)] = patch.on_leg;
  }
  now.force.setZero(3, points);
  for (Eigen::Index p = 0; p < points; ++p) {
    if (plan_.contacts.touching(p, 0)) now.touching[static_cast<std::size_t>(p)] = ContactState::kStick;
  }
  return now;
}

void PlannedContacts::look(double time_s, double horizon_s, bool is_uneven, ContactNow& contact) const {
  const std::vector<Patch>& patches = plan_.contacts.patches;
  const auto now = static_cast<std::size_t>(frame_at(plan_.target, time_s));
  const auto then = static_cast<std::size_t>(frame_at(plan_.target, time_s + horizon_s));
  contact.grip = 1;
  contact.in_air.clear();
  std::fill(contact.bearing.begin(), contact.bearing.end(), false);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const std::vector<ContactState>& planned = plan_.contacts.state[k];
    if (planned[now] == ContactState::kSlide) contact.grip = 0;
    const bool bears = planned[now] != ContactState::kOff && planned[then] != ContactState::kOff;
    bool touches = false;
    for (const int p : patches[k].points) {
      const auto point = static_cast<std::size_t>(p);
      contact.bearing[point] = bears;
      touches = touches || contact.touching[point] != ContactState::kOff;
    }
    const bool is_caught = is_uneven && touches && planned[now] == ContactState::kOff;
    if (patches[k].on_leg && (!touches || is_caught) && steps_next_[k][now]) contact.in_air.push_back(&patches[k]);
  }
  // In flight nothing holds the trunk against a leg that swings.
  if (contact.in_air.size() == patches.size()) contact.in_air.clear();
}

}  // namespace hydrostat::retarget

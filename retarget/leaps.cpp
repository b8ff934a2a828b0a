#include "retarget/leaps.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hydrostat::retarget {
namespace {

constexpr double kFeetOfLeaps = 1.0 / 8, kMomentumOfHops = 0.5;  // of the rows' usual weights
constexpr double kHorizonOfLeaps = 1.5, kEffortOfHops = 3.2, kNodesOfHops = 3, kSettleOnce = 0.4;  // times the usual

/// Frame f of a loop may lie a period on or before.
std::size_t wrapped(long f, long frames) { return static_cast<std::size_t>(((f % frames) + frames) % frames); }

/// What touches and where it stands, before any stance is lengthened.
struct Stances {
  ContactSchedule contacts;
  std::vector<std::vector<Hold>> holds;
};

/// Of the points' mean way along the ground, from the frame before to the one after; zero where they stay.
Eigen::Vector2d direction_of(const Motion& points, const std::vector<int>& own, Eigen::Index frame) {
  const Eigen::VectorXd velocity = velocities(points).col(frame);
  Eigen::Vector2d way = Eigen::Vector2d::Zero();
  for (const int p : own) way += Eigen::Vector2d(velocity[3 * p], velocity[3 * p + 2]);
  return way.norm() > 0 ? way.normalized() : way;
}

/// Lets patch k, which touches in frame f, touch in the `frames` after it, or before it where that is negative, as far as it was off
/// the ground there, on the place of frame f.
void lengthen(const Stances& before, const Motion& points, std::size_t k, long f, long frames, ContactSchedule& contacts,
              std::vector<std::vector<Hold>>& holds) {
  const long count = points.count(), direction = frames < 0 ? -1 : 1;
  const std::vector<int>& own = before.contacts.patches[k].points;
  for (long d = 1; d <= std::abs(frames); ++d) {
    const long h = f + direction * d;
    if (!points.loop && (h < 0 || h >= count)) break;
    const std::size_t g = wrapped(h, count);
    if (contacts.state[k][g] != ContactState::kOff) break;
    contacts.state[k][g] = frames < 0 ? ContactState::kSlide : ContactState::kStick;
    if (frames < 0) {
      const Eigen::Vector2d way = direction_of(points, own, static_cast<Eigen::Index>(g));
      contacts.sliding_x(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(g)) = way.x();
      contacts.sliding_z(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(g)) = way.y();
    }
    for (const int p : own) contacts.touching(p, static_cast<Eigen::Index>(g)) = before.contacts.touching(p, f);
    for (Hold hold : before.holds[static_cast<std::size_t>(f)]) {
      if (std::find(own.begin(), own.end(), hold.point) == own.end()) continue;
      if (h < 0) hold.place = after_cycles(points, 1) * hold.place;
      if (h >= count) hold.place = after_cycles(points, -1) * hold.place;
      holds[g].push_back(hold);
    }
  }
}

}  // namespace

std::vector<bool> frames_in_flight(const ContactSchedule& contacts, double rate_hz, bool loop) {
  const long frames = contacts.touching.cols();
  const auto touches = [&](long f) {
    const auto bears = [&](const std::vector<ContactState>& states) { return states[wrapped(f, frames)] != ContactState::kOff; };
    return std::any_of(contacts.state.begin(), contacts.state.end(), bears);
  };
  std::vector<bool> flying(static_cast<std::size_t>(frames), false);
  for (long f = 0; f < frames; ++f) {
    const bool begins = !touches(f) && (f == 0 ? !loop || touches(-1) : touches(f - 1));
    if (!begins) continue;
    long end = f;
    while (!touches(end) && (loop || end < frames)) ++end;
    if (static_cast<double>(end - f) / rate_hz < kLeap) continue;
    for (long g = f; g < end; ++g) flying[wrapped(g, frames)] = true;
  }
  return flying;
}

void prolong_stances(const Motion& points, long frames, ContactSchedule& contacts, std::vector<std::vector<Hold>>& holds) {
  const Stances before{contacts, holds};
  const long count = points.count();
  for (std::size_t k = 0; k < before.contacts.patches.size(); ++k) {
    for (long f = 0; f < count; ++f) {
      if (before.contacts.state[k][static_cast<std::size_t>(f)] != ContactState::kStick) continue;
      lengthen(before, points, k, f, -frames, contacts, holds);
      lengthen(before, points, k, f, frames, contacts, holds);
    }
  }
}

std::vector<std::vector<bool>> steps_next(const ContactSchedule& contacts, double rate_hz, bool loop) {
  const std::vector<bool> flying = frames_in_flight(contacts, rate_hz, loop);
  const long frames = static_cast<long>(flying.size());
  std::vector<std::vector<bool>> steps(contacts.state.size(), std::vector<bool>(flying.size(), true));
  for (std::size_t k = 0; k < steps.size(); ++k) {
    for (long f = 0; f < frames; ++f) {
      const long last = loop ? f + frames : frames;
      for (long g = f; g < last && contacts.state[k][wrapped(g, frames)] == ContactState::kOff; ++g) {
        if (flying[wrapped(g, frames)]) steps[k][static_cast<std::size_t>(f)] = false;
      }
    }
  }
  return steps;
}

bool has_flight(const PreparedTarget& plan) {
  const std::vector<bool> flying = frames_in_flight(plan.contacts, plan.target.rate_hz, plan.target.loop);
  return std::find(flying.begin(), flying.end(), true) != flying.end();
}

CorrectorOptions gain_of_leaps(const PreparedTarget& plan, const CorrectorOptions& options) {
  CorrectorOptions result = options;
  if (!has_flight(plan)) return result;
  result.foot_weight *= kFeetOfLeaps;
  result.horizon_s *= kHorizonOfLeaps;
  if (!plan.target.loop) {
    result.settle_s *= kSettleOnce;
    return result;
  }
  result.root_weight *= kMomentumOfHops;
  result.effort *= kEffortOfHops;
  result.node_weight *= kNodesOfHops;
  result.long_step = std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace hydrostat::retarget

#include "retarget/contacts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "retarget/gravity.h"

namespace hydrostat::retarget {
namespace {

constexpr double kQuick = 3;  // times the speed of what stands: a patch that must bear holds up to here

/// Runs of equal labels shorter than `least` take the label before them (round the seam of a loop too), shortest first.
void close_short_runs(std::vector<ContactState>& states, int least, bool loop) {
  const int count = static_cast<int>(states.size());
  const auto at = [&](int f) -> ContactState& { return states[static_cast<std::size_t>(((f % count) + count) % count)]; };
  for (int size = 1; size < least; ++size) {
    for (int f = 0; f < count; ++f) {
      if (!loop && f == 0) continue;
      if (at(f) == at(f - 1)) continue;
      int run = 1;
      while (run < count && (loop || f + run < count) && at(f + run) == at(f)) ++run;
      if (run != size || (!loop && f + run >= count)) continue;
      const ContactState before = at(f - 1);
      for (int k = 0; k < run; ++k) at(f + k) = before;
    }
  }
}

/// Runs of `state` shorter than `least` become what `other` says of the states before and after; at the ends of what is no
/// loop these are the run's own.
void replace_runs(std::vector<ContactState>& states, ContactState state, int least, bool loop,
                  const std::function<ContactState(ContactState before, ContactState after)>& other) {
  const int count = static_cast<int>(states.size());
  const std::vector<ContactState> old = states;
  const auto at = [&](int f) { return old[static_cast<std::size_t>(((f % count) + count) % count)]; };
  for (int f = 0; f < count; ++f) {
    if (at(f) != state) continue;
    int begin = f, end = f;
    while (f - begin < count && (loop || begin > 0) && at(begin - 1) == state) --begin;
    while (end - f < count && (loop || end < count - 1) && at(end + 1) == state) ++end;
    if (end - begin + 1 >= least) continue;
    states[static_cast<std::size_t>(f)] =
        other(loop || begin > 0 ? at(begin - 1) : state, loop || end < count - 1 ? at(end + 1) : state);
  }
}

/// Sliding directions 2 x F as means over the sliding ones of five frames, so that friction turns round gently: where the
/// direction turns, the mean is shorter than 1 and settles less of the friction. Zero where a patch does not slide.
Eigen::MatrixXd settled_directions(const Eigen::MatrixXd& direction, const std::vector<ContactState>& states, bool loop) {
  const Eigen::Index frames = direction.cols();
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(2, frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    if (states[static_cast<std::size_t>(f)] != ContactState::kSlide) continue;
    int count = 0;
    for (Eigen::Index d = -2; d <= 2; ++d) {
      const Eigen::Index g = loop ? (f + d + frames) % frames : std::clamp<Eigen::Index>(f + d, 0, frames - 1);
      if (states[static_cast<std::size_t>(g)] != ContactState::kSlide) continue;
      mean.col(f) += direction.col(g);
      ++count;
    }
    mean.col(f) /= count;
  }
  return mean;
}

/// What label_contacts sees of a patch in one frame.
struct PatchSight {
  double height = 0;                // [m] of its lowest point
  double sideways = 0, upward = 0;  // speeds of its low points [m/s]
};
using Sights = std::vector<std::vector<PatchSight>>;  // patches x F

/// A bone's contact points as label_contacts sees them.
struct Sighted {
  std::vector<PatchSight> sights;
  std::vector<ContactState> states;
  Eigen::MatrixXd direction;  // 2 x F, of sliding
};

/// Within which a patch touches: below `reach` [m], `hysteresis` times that while it does; slower than `still` sideways it sticks, faster
/// than `fall` up or down it does not touch [m/s].
struct Limits {
  double reach, hysteresis, still, fall;
};

/// `neighbours` are the points' frames with one more at either end.
Sighted look_at(const Motion& points, const Eigen::MatrixXd& neighbours, const std::vector<int>& members, const Limits& limits) {
  const Eigen::Index frames = points.count();
  Sighted seen;
  seen.sights.resize(static_cast<std::size_t>(frames));
  seen.states.assign(static_cast<std::size_t>(frames), ContactState::kOff);
  seen.direction = Eigen::MatrixXd::Zero(2, frames);
  ContactState previous = ContactState::kOff;
  for (int pass = 0; pass < (points.loop ? 2 : 1); ++pass) {  // twice round a loop, so that the seam has a history
    for (Eigen::Index f = 0; f < frames; ++f) {
      const auto x = points.at(f);
      double lowest = 1e300;
      for (const int p : members) lowest = std::min(lowest, x(1, p));
      // Speeds of the low points towards the frame before and the one after: the first and last frame of a stance stand
      // still on one side.
      Eigen::Vector3d before = Eigen::Vector3d::Zero(), after = before;
      int low = 0;
      for (const int p : members) {
        if (x(1, p) > lowest + 0.3 * limits.reach) continue;
        before += (neighbours.col(f + 1) - neighbours.col(f)).segment<3>(3 * p) * points.rate_hz;
        after += (neighbours.col(f + 2) - neighbours.col(f + 1)).segment<3>(3 * p) * points.rate_hz;
        ++low;
      }
      const Eigen::Vector3d velocity = (before.norm() < after.norm() ? before : after) / low;
      const double ease = previous == ContactState::kOff ? 1 : limits.hysteresis;
      const double sideways = std::hypot(velocity.x(), velocity.z());
      ContactState state = ContactState::kOff;
      if (lowest < limits.reach * ease && std::abs(velocity.y()) < limits.fall) {
        state = sideways < limits.still ? ContactState::kStick : ContactState::kSlide;
      }
      if (sideways > 0) seen.direction.col(f) = Eigen::Vector2d(velocity.x(), velocity.z()) / sideways;
      seen.states[static_cast<std::size_t>(f)] = previous = state;
      seen.sights[static_cast<std::size_t>(f)] = {lowest, sideways, std::abs(velocity.y())};
    }
  }
  return seen;
}

/// A foot that brushes the ground on its way through is not dragged, and one that glides for a moment in its stance stands: sliding counts
/// if it lasts. What is dragged and slow for a moment does not stand: between slides, standing counts if it lasts.
void settle(int least_frames, bool loop, std::vector<ContactState>& states) {
  const int least_run = 2 * least_frames + 1;
  replace_runs(states, ContactState::kSlide, least_run, loop, [](ContactState before, ContactState after) {
    return before == ContactState::kStick && after == ContactState::kStick ? ContactState::kStick : ContactState::kOff;
  });
  replace_runs(states, ContactState::kStick, least_run, loop, [](ContactState before, ContactState after) {
    return before == ContactState::kSlide && after == ContactState::kSlide ? ContactState::kSlide : ContactState::kStick;
  });
  close_short_runs(states, least_frames, loop);
}

/// Whether two bones rise and sink together: their heights differ by less than half of what they deviate from their mean, as those of equal
/// swings do up to 30 degrees of phase. What hardly moves may differ by half of `reach` [m].
bool are_in_phase(const std::vector<PatchSight>& one, const std::vector<PatchSight>& other, double reach) {
  const double frames = static_cast<double>(one.size());
  double middle = 0, apart = 0, swing = 0;
  for (std::size_t f = 0; f < one.size(); ++f) middle += 0.5 * (one[f].height + other[f].height) / frames;
  for (std::size_t f = 0; f < one.size(); ++f) {
    apart += std::abs(one[f].height - other[f].height) / frames;
    swing += std::abs(0.5 * (one[f].height + other[f].height) - middle) / frames;
  }
  return apart < 0.5 * std::max(swing, reach);
}

/// What holds goes before what is dragged, and that before what is away.
ContactState firmer(ContactState a, ContactState b) {
  for (const ContactState state : {ContactState::kStick, ContactState::kSlide}) {
    if (a == state || b == state) return state;
  }
  return ContactState::kOff;
}

/// What a patch must keep within to bear a body that has nothing else to stand on.
struct BearingLimits {
  double height = 0, upward = 0, sideways = 0;  // [m], [m/s]; what is faster sideways slides
};

/// Runs of frames in which no patch touches, as first frame and length, between two frames that have contact.
std::vector<std::pair<int, int>> gaps_of(const std::vector<std::vector<ContactState>>& states, bool loop) {
  const int frames = static_cast<int>(states.front().size());
  const auto flies = [&](int f) {
    return std::all_of(states.begin(), states.end(),
                       [&](const auto& of) { return of[static_cast<std::size_t>(f % frames)] == ContactState::kOff; });
  };
  std::vector<std::pair<int, int>> gaps;
  for (int f = 0; f < frames; ++f) {
    if (!flies(f + 1) || flies(f)) continue;
    int length = 1;
    while (length < frames && flies(f + 1 + length)) ++length;
    if (loop || f + 1 + length < frames) gaps.emplace_back((f + 1) % frames, length);
  }
  return gaps;
}

/// A body that flies for T rises over the line between its ends by g T2 / 12 in the mean; half of that is a flight. `middle`
/// [m] is the body's height in each frame.
bool falls_in(const std::pair<int, int>& gap, const Eigen::VectorXd& middle, double rate_hz) {
  const auto height = [&](int k) { return middle[(gap.first + k + middle.size()) % middle.size()]; };
  const int steps = gap.second + 1;  // between the last frame on the ground and the next
  const double first = height(-1), rise = height(gap.second) - first, time = steps / rate_hz;
  double above = 0;
  for (int k = 0; k < gap.second; ++k) above += height(k) - first - rise * (k + 1) / steps;
  return above / steps > 0.5 * kGravity * time * time / 12;
}

/// Where nothing touches although the body does not fall, the patch bears that is lowest and slowest.
void support_what_does_not_fall(const Eigen::VectorXd& middle, const Sights& sights, double rate_hz, bool loop,
                                const BearingLimits& limits, std::vector<std::vector<ContactState>>& states) {
  if (states.empty()) return;
  for (const std::pair<int, int>& gap : gaps_of(states, loop)) {
    if (falls_in(gap, middle, rate_hz)) continue;
    for (int k = 0; k < gap.second; ++k) {
      const std::size_t f = static_cast<std::size_t>((gap.first + k) % static_cast<int>(middle.size()));
      const auto cost = [&](const std::vector<PatchSight>& sight) {
        return sight[f].height / limits.height + sight[f].sideways / limits.sideways;
      };
      const auto by_cost = [&](const auto& a, const auto& b) { return cost(a) < cost(b); };
      const std::size_t best =
          static_cast<std::size_t>(std::min_element(sights.begin(), sights.end(), by_cost) - sights.begin());
      const PatchSight& sight = sights[best][f];
      if (sight.height > limits.height || sight.upward > limits.upward) continue;
      states[best][f] = sight.sideways < limits.sideways ? ContactState::kStick : ContactState::kSlide;
    }
  }
}

}  // namespace

bool is_dragged(const ContactSchedule& contacts) {
  const auto slides = [](const std::vector<ContactState>& states) {
    const std::vector<ContactState> twice(2, ContactState::kSlide);
    return std::search(states.begin(), states.end(), twice.begin(), twice.end()) != states.end();
  };
  return std::any_of(contacts.state.begin(), contacts.state.end(), slides);
}

double ContactSchedule::flight_s(double rate_hz) const {
  Eigen::Index flying = 0;
  for (Eigen::Index f = 0; f < touching.cols(); ++f) flying += touching.col(f).any() ? 0 : 1;
  return static_cast<double>(flying) / rate_hz;
}

double ground_height(const Motion& points) {
  std::vector<double> lowest;
  for (Eigen::Index f = 0; f < points.count(); ++f) lowest.push_back(points.at(f).row(1).minCoeff());
  std::sort(lowest.begin(), lowest.end());
  return lowest[lowest.size() / 5];
}

Motion point_motion(const physics::ContactPoints& points, const Motion& nodes) {
  Motion result = nodes;
  result.frames.resize(3 * points.count(), nodes.count());
  for (Eigen::Index f = 0; f < nodes.count(); ++f) {
    for (int p = 0; p < points.count(); ++p) result.frames.col(f).segment<3>(3 * p) = points.of(nodes.at(f), p);
  }
  return result;
}

ContactSchedule label_contacts(const Motion& points, const std::vector<int>& bone_of_point,
                               const std::vector<std::string>& bone_names, double length, double size,
                               const ContactOptions& options, const std::vector<std::array<int, 2>>& mirrored) {
  const Eigen::Index frames = points.count();
  const Eigen::MatrixXd speed = velocities(points), neighbours = padded_frames(points, 1);
  const double reach = options.height * size;
  double squared = 0;
  for (Eigen::Index f = 0; f < frames; ++f) {
    for (Eigen::Index p = 0; p < speed.rows() / 3; ++p)
      squared += speed(3 * p, f) * speed(3 * p, f) + speed(3 * p + 2, f) * speed(3 * p + 2, f);
  }
  const double rms_speed = std::sqrt(squared / static_cast<double>(frames * speed.rows() / 3));
  const double wave = std::sqrt(kGravity * length);
  const double still = std::max(options.least_still_speed * wave, options.still_speed * rms_speed);
  const double fall = options.fall_speed * wave;

  const Limits limits{reach, options.hysteresis, still, fall};
  std::map<int, std::vector<int>> points_of_bone;
  for (std::size_t p = 0; p < bone_of_point.size(); ++p) points_of_bone[bone_of_point[p]].push_back(static_cast<int>(p));
  std::map<int, Sighted> sighted;
  for (const auto& [bone, members] : points_of_bone) {
    sighted[bone] = look_at(points, neighbours, members, limits);
    settle(options.least_frames, points.loop, sighted[bone].states);
  }
  const bool drags = std::any_of(sighted.begin(), sighted.end(), [](const auto& seen) {
    const std::vector<ContactState>& states = seen.second.states;
    return std::find(states.begin(), states.end(), ContactState::kSlide) != states.end();
  });
  for (const auto& [left, right] : mirrored) {
    if (drags) break;  // no legs: the two ends of a worm are no pair
    Sighted &one = sighted.at(left), &other = sighted.at(right);
    if (!are_in_phase(one.sights, other.sights, reach)) continue;
    for (std::size_t f = 0; f < one.states.size(); ++f) one.states[f] = other.states[f] = firmer(one.states[f], other.states[f]);
  }

  ContactSchedule schedule;
  schedule.touching = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(
      static_cast<Eigen::Index>(bone_of_point.size()), frames, false);
  std::vector<Eigen::MatrixXd> directions;
  Sights sights;
  for (auto& [bone, seen] : sighted) {
    if (std::all_of(seen.states.begin(), seen.states.end(), [](ContactState s) { return s == ContactState::kOff; })) continue;
    schedule.patches.push_back({bone_names[static_cast<std::size_t>(bone)], points_of_bone.at(bone)});
    schedule.state.push_back(std::move(seen.states));
    directions.push_back(std::move(seen.direction));
    sights.push_back(std::move(seen.sights));
  }
  Eigen::VectorXd middle(frames);
  for (Eigen::Index f = 0; f < frames; ++f) middle[f] = points.at(f).row(1).mean();
  support_what_does_not_fall(middle, sights, points.rate_hz, points.loop,
                             {options.support_height * length, fall, kQuick * still}, schedule.state);
  for (std::size_t k = 0; k < directions.size(); ++k) {
    close_short_runs(schedule.state[k], options.least_frames, points.loop);
    directions[k] = settled_directions(directions[k], schedule.state[k], points.loop);
  }
  schedule.sliding_x.resize(static_cast<Eigen::Index>(directions.size()), frames);
  schedule.sliding_z = schedule.sliding_x;
  for (std::size_t k = 0; k < directions.size(); ++k) {
    schedule.sliding_x.row(static_cast<Eigen::Index>(k)) = directions[k].row(0);
    schedule.sliding_z.row(static_cast<Eigen::Index>(k)) = directions[k].row(1);
  }
  mark_touching(points, options.load_height * size, schedule);
  return schedule;
}

void mark_touching(const Motion& points, double height, ContactSchedule& schedule) {
  schedule.touching.setConstant(false);
  for (std::size_t k = 0; k < schedule.patches.size(); ++k) {
    for (Eigen::Index f = 0; f < points.count(); ++f) {
      if (schedule.state[k][static_cast<std::size_t>(f)] == ContactState::kOff) continue;
      const auto x = points.at(f);
      double lowest = 1e300;
      for (const int p : schedule.patches[k].points) lowest = std::min(lowest, x(1, p));
      for (const int p : schedule.patches[k].points) schedule.touching(p, f) = x(1, p) <= std::max(lowest, 0.0) + height;
    }
  }
}

}  // namespace hydrostat::retarget

#include "retarget/prepare.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>

#include "retarget/balance.h"
#include "retarget/leaps.h"
#include "retarget/let_go.h"
#include "retarget/mirror.h"
#include "retarget/needed_strain.h"
#include "retarget/shape_projection.h"
#include "retarget/smooth.h"

namespace hydrostat::retarget {
namespace {

constexpr double kGoodBalance = 0.02;  // badness that needs no more contacts
constexpr double kOverReach = 4.0 / 3; // times reach: what a clip needs beyond that is held back
constexpr double kFliesOff = 0.7;     // of sqrt(g L), sideways: feet of a trot leave with 0.25, those of a far leap with 1 to 2
constexpr ShiftCosts kLeapCosts{0.075, 0.2};  // of a leap that would be moved further: it launches by force and lands softly; measured on a frog
constexpr double kLeapFriction = 1.05;  // times the usual share of friction: it is moved less
constexpr double kLonger = 1.0 / 60;    // [s] that its stances last longer at both ends
constexpr double kReachInFlight = 0.065;  // strain that its shape is held back less where nothing bears,
constexpr double kClearOfGround[] = {1.0 / 60, 0.1};  // [s] from the last contact on and until so long before the next
constexpr double kRest = 0.04;        // by which a shift's badness may grow where a one-shot starts from rest and comes to rest
constexpr double kSpreadShift = 0.15;   // share of the usual cost of the shift where load is spread
constexpr int kSpreadRounds = 8;        // after which some 1e-4 m g are missing where contact can give all at all
constexpr double kWorseBalance = 1.5;  // times the least badness: fewer contacts are preferred up to here

double rms_difference(const Motion& a, const Motion& b, const Eigen::VectorXd& mass) {
  double sum = 0;
  for (Eigen::Index f = 0; f < a.count(); ++f) {
    sum += ((a.at(f) - b.at(f)).colwise().squaredNorm() * mass)(0) / mass.sum();
  }
  return std::sqrt(sum / static_cast<double>(a.count()));
}

/// Labels at the smallest of a few heights that lets the body stand: what hovers a little higher was meant to bear weight where
/// the clip cannot be balanced without it (a worm's dragged end). Badness counts missing force per weight and shift per L.
ContactSchedule choose_contacts(const Motion& grounded, const Motion& points, const physics::Scene& scene, const std::vector<int>& patch_bone,
                                const std::vector<std::string>& bone_names, double length, double size, const PrepareOptions& options) {
  std::vector<ContactSchedule> schedules;
  std::vector<double> badness;
  Eigen::Matrix3Xd rest(3, scene.contact_points.count());
  for (int p = 0; p < scene.contact_points.count(); ++p) rest.col(p) = scene.contact_points.of(scene.body.rest, p);
  const std::vector<std::array<int, 2>> mirrored = mirrored_bones(rest, patch_bone, length);
  for (const double factor : {1.0, 2.0, 3.5, 5.0}) {
    ContactOptions contact_options = options.contacts;
    contact_options.height *= factor;
    schedules.push_back(label_contacts(points, patch_bone, bone_names, length, size, contact_options, mirrored));
    badness.push_back(find_shift(grounded, scene, schedules.back(), length, options.support_friction, 12).badness);
    if (badness.back() < kGoodBalance) break;
  }
  const double least = *std::min_element(badness.begin(), badness.end());
  std::size_t chosen = 0;
  while (badness[chosen] > std::max(kGoodBalance, kWorseBalance * least)) ++chosen;
  return schedules[chosen];
}

/// At which ends of a one-shot the body can be at rest, as it is in a replay. What is cut from a walk eases in and out; what starts in the air cannot.
RestingEnds resting_ends(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts, double length,
                         double support_friction) {
  if (target.loop) return {};
  const auto badness = [&](RestingEnds ends) {
    return find_shift(target, scene, contacts, length, support_friction, 12, {}, {}, ends).badness;
  };
  const double most = badness({}) + kRest;
  for (const RestingEnds ends : {RestingEnds{true, true}, RestingEnds{false, true}, RestingEnds{true, false}}) {
    if (badness(ends) < most) return ends;
  }
  return {};
}

/// Whether a clip leaps and loads that come and go gently would move it too far.
bool leaps_far(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts, double length, double support_friction) {
  if (contacts.flight_s(target.rate_hz) < kLeap) return false;
  const Shift shift = find_shift(target, scene, contacts, length, support_friction);
  const double far = std::sqrt(shift.move.squaredNorm() / static_cast<double>(shift.move.cols()));
  return far > kMostShift * length;
}

/// The foot lock: the mean offset of each patch to its holds moves its bone's nodes and fades out over the frames around the contact.
Motion lock_feet(const Motion& motion, const physics::Scene& scene, const ContactSchedule& contacts,
                 const std::vector<std::vector<Hold>>& holds, const Eigen::MatrixXd& floor, const std::vector<std::string>& bone_names,
                 const Eigen::MatrixXd& node_bone_weights, double smooth_hz) {
  std::map<std::string, Eigen::Index> bone_index;
  for (std::size_t b = 0; b < bone_names.size(); ++b) bone_index[bone_names[b]] = static_cast<Eigen::Index>(b);
  const Motion points = point_motion(scene.contact_points, motion);
  Motion locked = motion;
  for (const Patch& patch : contacts.patches) {
    Motion offset;
    offset.rate_hz = motion.rate_hz;
    offset.loop = motion.loop;
    offset.yaw = motion.yaw;
    offset.frames = Eigen::MatrixXd::Zero(3, motion.count());
    for (long f = 0; f < motion.count(); ++f) {
      int count = 0;
      for (const Hold& hold : holds[static_cast<std::size_t>(f)]) {
        if (!std::binary_search(patch.points.begin(), patch.points.end(), hold.point)) continue;
        Eigen::Vector3d error = hold.place - points.at(f).col(hold.point);
        if (!hold.sideways) error.x() = error.z() = 0;
        offset.frames.col(f) += error;
        ++count;
      }
      if (count > 0) offset.frames.col(f) /= count;
      if (count == 0) {
        for (const int p : patch.points) offset.frames(1, f) = std::max(offset.frames(1, f), floor(p, f) - points.at(f)(1, p));
      }
    }
    offset = smooth(offset, smooth_hz);
    const Eigen::Index bone = bone_index.at(patch.name);
    for (long f = 0; f < motion.count(); ++f) {
      for (int i = 0; i < scene.body.node_count(); ++i) locked.at(f).col(i) += node_bone_weights(bone, i) * offset.frames.col(f);
    }
  }
  return locked;
}

/// What the finished target lacks, and how well it keeps its volume.
void measure(const PreparedTarget& prepared, const physics::Body& body, PreparationReport& report) {
  const Eigen::RowVectorXd missing = prepared.missing_wrench.topRows<3>().colwise().norm();
  report.missing_wrench_max_mg = missing.maxCoeff();
  report.missing_wrench_rms_mg = std::sqrt(missing.squaredNorm() / static_cast<double>(missing.size()));
  report.flight_s = prepared.contacts.flight_s(prepared.target.rate_hz);
  report.min_jacobian = std::numeric_limits<double>::infinity();
  double squared = 0;
  for (Eigen::Index f = 0; f < prepared.target.count(); ++f) {
    const Eigen::VectorXd jacobian = physics::jacobians(body, prepared.target.at(f));
    report.min_jacobian = std::min(report.min_jacobian, jacobian.minCoeff());
    squared += (jacobian.array() - 1).square().mean();
  }
  report.volume_error_rms = std::sqrt(squared / static_cast<double>(prepared.target.count()));
}

/// The strain to which the shape is held: none where the clip needs little more than reach. Adds a warning where it needs more.
double reach_of(const Motion& motion, const physics::Body& body, double reach, std::vector<std::string>& warnings) {
  const double need = needed_strain(body, motion);
  if (need <= kOverReach * reach) return std::numeric_limits<double>::infinity();
  char text[200];
  std::snprintf(text, sizeof text,
                "the clip stretches and squeezes constraints by %.0f %%, the body reaches %.0f %%: its shape is held back to that; "
                "a clip that stretches less stays as it is",
                100 * need, 100 * reach);
  warnings.push_back(text);
  return reach;
}

/// F: `reach`, and more where a far leap is clear of the ground: what bears nothing follows its clip further without harm.
Eigen::VectorXd reach_of_frames(const ContactSchedule& contacts, double rate_hz, bool loop, double reach, bool is_far_leap) {
  const long frames = contacts.touching.cols();
  Eigen::VectorXd result = Eigen::VectorXd::Constant(frames, reach);
  if (!is_far_leap) return result;
  const long since = std::lround(kClearOfGround[0] * rate_hz), until = std::lround(kClearOfGround[1] * rate_hz);
  const std::vector<bool> flying = frames_in_flight(contacts, rate_hz, loop);
  for (long f = 0; f < frames; ++f) {
    bool is_clear = true;
    for (long g = f - since; g <= f + until; ++g) {
      const bool is_inside = loop || (g >= 0 && g < frames);
      is_clear = is_clear && (!is_inside || flying[static_cast<std::size_t>((g + frames) % frames)]);
    }
    if (is_clear) result[f] += kReachInFlight;
  }
  return result;
}

/// Where feet are off the ground because the target has lifted them they bear nothing, nor, in a far leap, where they fly off.
void mark_loads(const Motion& target, const physics::Scene& scene, double length, double size, bool is_far_leap, ContactSchedule& contacts) {
  const Motion points = point_motion(scene.contact_points, target);
  mark_touching(points, kTouching * size, contacts);
  if (is_far_leap) let_go(points, kFliesOff * std::sqrt(scene.gravity.norm() * length), contacts);
}

void lower_by(double ground, Motion& motion) {
  for (Eigen::Index r = 1; r < motion.frames.rows(); r += 3) motion.frames.row(r).array() -= ground;
}

}  // namespace

PreparedTarget prepare(const Motion& coupled, const physics::Scene& scene, const std::vector<int>& patch_bone,
                       const std::vector<std::string>& bone_names, const Eigen::MatrixXd& node_bone_weights, double length,
                       double size, const PrepareOptions& options) {
  const physics::Body& body = scene.body;
  PreparedTarget result;
  PreparationReport& report = result.report;
  ContactSchedule& contacts = result.contacts;
  Motion& target = result.target;
  target = smooth(coupled, options.smooth_hz);
  result.support_friction = options.support_friction;
  result.firmness = options.firmness;
  report.smooth_shift_rms_length = rms_difference(target, coupled, body.mass) / length;

  Motion points = point_motion(scene.contact_points, coupled);
  const double ground = ground_height(points);
  lower_by(ground, target);
  lower_by(ground, points);
  const Motion grounded = target;
  contacts = choose_contacts(target, points, scene, patch_bone, bone_names, length, size, options);
  std::vector<std::vector<Hold>> holds = find_holds(contacts, points);
  Eigen::MatrixXd floor;
  Motion locked;
  ShapeProjector projector(scene, length, options.volume, options.firmness);
  std::optional<double> held_to;
  Eigen::VectorXd reach;
  bool is_far_leap = false;  // then loads do not fade by themselves before a foot leaves
  const auto set_feet = [&] {
    floor = floors(contacts, grounded.loop, options.clearance * size, options.clearance_frames);
    locked = lock_feet(grounded, scene, contacts, holds, floor, bone_names, node_bone_weights, options.smooth_hz);
    if (!held_to) held_to = reach_of(locked, body, options.reach, result.warnings);
    reach = reach_of_frames(contacts, grounded.rate_hz, grounded.loop, *held_to, is_far_leap);
    target = project_frames(locked, holds, floor, reach, projector, options.smooth_hz);
  };
  const auto mark = [&] { mark_loads(target, scene, length, size, is_far_leap, contacts); };
  set_feet();
  mark();
  if (options.momentum) is_far_leap = leaps_far(target, scene, contacts, length, options.support_friction);
  if (is_far_leap) {
    result.support_friction *= kLeapFriction;
    prolong_stances(points, std::lround(kLonger * points.rate_hz), contacts, holds);
    set_feet();
    mark();
  }
  if (options.momentum) result.ends = resting_ends(target, scene, contacts, length, result.support_friction);
  report.foot_shift_rms_length = rms_difference(locked, grounded, body.mass) / length;
  report.volume_shift_rms_length = rms_difference(target, locked, body.mass) / length;
  const Motion before_momentum = target;
  Motion wanted = locked;  // the animator's shape with the shifts so far
  ShiftCosts costs = is_far_leap ? kLeapCosts : ShiftCosts();
  if (options.spread_load) costs.shift = kSpreadShift;
  Shift so_far;
  for (int round = 0; options.momentum && round < (options.spread_load ? kSpreadRounds : options.rounds); ++round) {
    // Few rounds that each forget the last keep some margin, too, for they lean on; where the load is spread they end in balance.
    const Shift counted = options.spread_load ? so_far : Shift();
    const Shift shift = find_shift(target, scene, contacts, length, result.support_friction, 60, costs, counted, result.ends);
    add(shift, so_far);
    wanted = shifted(wanted, shift, body);
    target = project_frames(wanted, holds, floor, reach, projector, options.smooth_hz);
    fall_freely(contacts, scene, target);
    mark();
  }
  report.momentum_shift_rms_length = rms_difference(target, before_momentum, body.mass) / length;
  report.total_shift_rms_length = rms_difference(target, grounded, body.mass) / length;
  result.missing_wrench = missing_wrench(target, scene, contacts, length, result.support_friction, result.ends);
  measure(result, body, report);
  return result;
}

}  // namespace hydrostat::retarget

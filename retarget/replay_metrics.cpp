#include "retarget/replay_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "retarget/reference_glide.h"

namespace hydrostat::retarget {
namespace {

constexpr double kBuzz = 10;             // [Hz]
constexpr double kNothingBelow = 1e299;  // [m]: as high is a patch where there is no ground
constexpr double kLeastRange = 1e-3;     // of L: a clip whose skin moves less within the body has no style to lose
constexpr double kLeastShareOfPoints = 0.1;  // of those that move most: what the least ratio leaves below it

constexpr double kUntold = std::numeric_limits<double>::quiet_NaN();  // what a run does not tell

/// Slope of the least-squares line through (x, y); untold where they are fewer than two places.
double slope(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() < 2) return kUntold;
  const double n = static_cast<double>(x.size());
  double mx = 0, my = 0, sxy = 0, sxx = 0;
  for (std::size_t i = 0; i < x.size(); ++i) mx += x[i] / n, my += y[i] / n;
  for (std::size_t i = 0; i < x.size(); ++i) sxy += (x[i] - mx) * (y[i] - my), sxx += (x[i] - mx) * (x[i] - mx);
  return sxx > 0 ? sxy / sxx : kUntold;
}

/// Headings [rad] that go on beyond half a turn.
std::vector<double> unwound(std::vector<double> headings) {
  for (std::size_t k = 1; k < headings.size(); ++k) {
    headings[k] = headings[k - 1] + std::remainder(headings[k] - headings[k - 1], 2 * M_PI);
  }
  return headings;
}

Eigen::Vector3d spin_of(const physics::Body& body, const physics::State& state) {
  return physics::angular_momentum(body, state.x, state.v, Eigen::Vector3d::Zero());
}

Eigen::VectorXd even_shares(Eigen::Index count) {
  return Eigen::VectorXd::Constant(count, 1.0 / static_cast<double>(count));
}

/// All courses of one number a step.
std::array<Eigen::VectorXd*, 7> numbers_of(ReplayCourse& course) {
  return {&course.time_s,    &course.height,       &course.heading_deg, &course.correction,
          &course.saturated, &course.volume_ratio, &course.slip_speed};
}

ReplayCourse empty_course(long steps, std::size_t patches) {
  ReplayCourse course;
  for (Eigen::VectorXd* values : numbers_of(course)) values->resize(steps);
  course.com.resize(3, steps);
  course.target_com.resize(3, steps);
  course.patch_state.assign(patches, {});
  return course;
}

}  // namespace

ReplayMetrics::ReplayMetrics(const ReplayInput& input, double control_s, long most_steps, const physics::State& start)
    : input_(input),
      control_s_(control_s),
      length_(input.length),
      weight_(input.scene.body.mass.sum() * gravity_unit(input.scene)),
      period_s_(input.prepared.target.duration_s()),
      rest_volume_(physics::volume(input.scene.body, input.scene.body.rest)),
      thresholds_(contact_thresholds(input.scene, input.length, control_s)),
      mass_shares_(input.scene.body.mass / input.scene.body.mass.sum()),
      even_shares_(even_shares(input.skin_points.count())),
      clip_curve_(input.clip_skin),
      clip_every_(2 * std::max(1L, std::lround(1 / (input.prepared.target.rate_hz * control_s)))),
      start_com_(start.x * mass_shares_),
      momentum_(physics::momentum(input.scene.body, start.v)),
      spin_(spin_of(input.scene.body, start)),
      course_(empty_course(most_steps, input.prepared.contacts.patches.size())),
      fast_(kBuzz, 1 / control_s, input.muscles.fields.cols()),
      highest_(start_com_.y()) {}

void ReplayMetrics::add(const ControlStep& step) {
  ++steps_;
  balance_momentum(step);
  compare_shape(step);
  compare_way(step);
  compare_with_clip(step);
  watch_points(step);
  watch_patches(step);
  write_course(step);
}

void ReplayMetrics::balance_momentum(const ControlStep& step) {
  const physics::Body& body = input_.scene.body;
  const Eigen::Vector3d momentum = physics::momentum(body, step.state.v), spin = spin_of(body, step.state);
  const Eigen::Vector3d change = momentum - momentum_ - control_s_ * body.mass.sum() * input_.scene.gravity -
                                 step.impulses.contact_nodes.rowwise().sum() - step.impulses.effect_nodes.rowwise().sum();
  const Eigen::Vector3d turned =
      spin - spin_ - step.impulses.gravity_moment - step.impulses.contact_moment - step.impulses.effect_moment;
  report_.momentum_residual_mg = std::max(report_.momentum_residual_mg, change.norm() / control_s_ / weight_);
  report_.angular_residual_mgl = std::max(report_.angular_residual_mgl, turned.norm() / control_s_ / (weight_ * length_));
  const double assist = step.impulses.correction_nodes.colwise().norm().sum() / control_s_ / weight_;
  if (assist > report_.external_assist_mg) report_.external_assist_mg = assist, report_.external_assist_time_s = step.time_s;
  momentum_ = momentum;
  spin_ = spin;
}

void ReplayMetrics::compare_shape(const ControlStep& step) {
  shape_.add(step.fit.rms * step.fit.rms);
  world_.add(((step.state.x - step.reference.x).colwise().squaredNorm() * mass_shares_)(0));
  feedback_.add(step.feedback.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, step.feedback.size())));
  const double muscles = static_cast<double>(std::max<Eigen::Index>(1, step.correction.size()));
  correction_.add(step.correction.squaredNorm() / muscles);
  buzz_.add(fast_.next(step.correction).squaredNorm() / muscles);
  course_.correction[steps_ - 1] = std::sqrt(step.correction.squaredNorm() / muscles);
  const double volume_ratio = physics::volume(input_.scene.body, step.state.x) / rest_volume_;
  report_.volume_error_max = std::max(report_.volume_error_max, std::abs(volume_ratio - 1));
  course_.volume_ratio[steps_ - 1] = volume_ratio;
  const auto inverted = (physics::jacobians(input_.scene.body, step.state.x).array() <= 0).count();
  report_.inverted_elements = std::max(report_.inverted_elements, static_cast<int>(inverted));
}

void ReplayMetrics::compare_way(const ControlStep& step) {
  const double cycle = step.time_s / period_s_;
  highest_ = std::max(highest_, step.fit.mean_b.y());
  if (input_.prepared.target.loop && cycle < 2) return;
  const Eigen::Vector3d error = step.fit.mean_b - step.fit.mean_a;
  cycle_.push_back(cycle);
  drift_.push_back(std::hypot(error.x(), error.z()));
  heading_.push_back(yaw_of(step.fit.rotation));
}

void ReplayMetrics::compare_with_clip(const ControlStep& step) {
  if (steps_ % clip_every_ != 0) return;
  if (!input_.prepared.target.loop && step.time_s > period_s_) return;
  Eigen::Matrix3Xd clip_x, clip_v, skin(3, input_.skin_points.count());
  clip_curve_.at(step.time_s, clip_x, clip_v);
  for (int p = 0; p < input_.skin_points.count(); ++p) skin.col(p) = input_.skin_points.of(step.state.x, p);
  const double rms = best_rigid_fit(clip_x, skin, even_shares_).rms;
  clip_shape_.add(rms * rms);
  const auto within_body = [&](const Eigen::Matrix3Xd& points) -> Eigen::Matrix3Xd {
    const RigidFit fit = best_rigid_fit(points, input_.clip_skin.at(0), even_shares_);
    return fit.rotation * (points.colwise() - fit.mean_a);
  };
  range_.add(within_body(skin));
  clip_range_.add(within_body(clip_x));
}

void ReplayMetrics::Range::add(const Eigen::Matrix3Xd& points) {
  if (count == 0) sum.setZero(3, points.cols()), squares.setZero(points.cols());
  sum += points;
  squares += points.colwise().squaredNorm().transpose();
  ++count;
}

Eigen::VectorXd ReplayMetrics::Range::squared() const {
  const double n = static_cast<double>(count);
  return (squares / n - (sum / n).colwise().squaredNorm().transpose()).cwiseMax(0);
}

/// Of all points together, and of that one among those that move most which does so least, but for a tenth of them.
void ReplayMetrics::measure_style(ReplayReport& report) const {
  if (clip_range_.count < 2) return;
  const Eigen::VectorXd moved = range_.squared(), in_clip = clip_range_.squared();
  if (std::sqrt(in_clip.mean()) < kLeastRange * length_) return;
  report.style_range = std::sqrt(moved.mean() / in_clip.mean());
  std::vector<double> ratios;
  for (Eigen::Index p = 0; p < moved.size(); ++p) {
    if (in_clip[p] >= in_clip.mean()) ratios.push_back(std::sqrt(moved[p] / in_clip[p]));
  }
  const auto place = ratios.begin() + static_cast<long>(kLeastShareOfPoints * static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), place, ratios.end());
  report.style_range_least = *place;
}

void ReplayMetrics::watch_points(const ControlStep& step) {
  double lowest = 0;
  for (int p = 0; p < input_.scene.contact_points.count(); ++p) {
    if (step.touching[static_cast<std::size_t>(p)] == ContactState::kOff) continue;
    lowest = std::min(lowest, height_above_ground(input_.scene, step.state, p));
  }
  report_.penetration_max_size = std::max(report_.penetration_max_size, -lowest / input_.size);
}

void ReplayMetrics::watch_patches(const ControlStep& step) {
  const ContactSchedule& plan = input_.prepared.contacts;
  const auto frame = static_cast<std::size_t>(frame_at(input_.prepared.target, step.time_s));
  double fastest = 0;
  for (std::size_t k = 0; k < plan.patches.size(); ++k) {
    const PatchLoad load = patch_load(input_.scene, plan.patches[k], step.state, step.impulses.contact);
    const bool is_loaded = load.normal_impulse > thresholds_.patch_impulse;
    if (is_loaded) fastest = std::max(fastest, load.speed);
    const ContactState moving = load.speed > thresholds_.sliding_speed ? ContactState::kSlide : ContactState::kStick;
    course_.patch_state[k].push_back(is_loaded ? moving : ContactState::kOff);
    if (plan.state[k][frame] != ContactState::kStick) continue;
    const double gap = patch_height(input_.scene, plan.patches[k], step.state);
    if (gap < kNothingBelow) sole_gap_.add(std::max(0.0, gap));
  }
  course_.slip_speed[steps_ - 1] = fastest;
}

void ReplayMetrics::write_course(const ControlStep& step) {
  const long row = steps_ - 1;
  const double at_limit = 0.999 * input_.limit;
  course_.time_s[row] = step.time_s;
  course_.height[row] = step.fit.mean_b.y();
  course_.heading_deg[row] = yaw_of(step.fit.rotation) * 180 / M_PI;
  course_.saturated[row] =
      (step.activation.array() - 1).abs().unaryExpr([&](double a) { return a > at_limit ? 1.0 : 0.0; }).mean();
  course_.com.col(row) = step.fit.mean_b;
  course_.target_com.col(row) = step.fit.mean_a;
}

void ReplayMetrics::measure_way(ReplayReport& report) const {
  // Along the clip's own way: over whole cycles of a loop, over all of a one-shot.
  const bool loop = input_.prepared.target.loop;
  const Motion& clip = input_.clip_skin;
  const Eigen::Vector3d way =
      loop ? clip.travel : Eigen::Vector3d(clip.at(clip.count() - 1).rowwise().mean() - clip.at(0).rowwise().mean());
  const Eigen::Vector3d level_way(way.x(), 0, way.z());
  const double distance = level_way.norm();
  const double cycles = loop ? std::max(1.0, std::floor(report.cycles + 1e-6)) : 1;
  const long last = loop ? std::min(steps_, std::lround(cycles * period_s_ / control_s_)) : steps_;
  const Eigen::Vector3d gone = course_.com.col(last - 1) - start_com_;
  const double along = distance > 1e-9 ? gone.dot(level_way) / distance : std::hypot(gone.x(), gone.z());
  report.clip_travel_per_cycle_length = distance / length_;
  report.travel_per_cycle_length = along / cycles / length_;
}

void ReplayMetrics::measure_drift(ReplayReport& report) const {
  if (input_.prepared.target.loop) {
    report.drift_per_cycle_length = slope(cycle_, drift_) / length_;
    report.heading_deg_per_cycle = slope(cycle_, unwound(heading_)) * 180 / M_PI;
  } else {
    report.drift_per_cycle_length = drift_.empty() ? kUntold : drift_.back() / length_;
    report.heading_deg_per_cycle = heading_.empty() ? kUntold : unwound(heading_).back() * 180 / M_PI;
  }
}

void ReplayMetrics::measure_apex(ReplayReport& report) const {
  report.apex_rise_length = (highest_ - start_com_.y()) / length_;
  report.clip_apex_rise_length = input_.clip_rise / length_;
}

ReplayReport ReplayMetrics::figures() const {
  ReplayReport report = report_;
  measure_drift(report);
  if (steps_ == 0) return report;
  report.duration_s = course_.time_s[steps_ - 1];
  report.cycles = report.duration_s / period_s_;
  report.shape_rms_length = std::sqrt(shape_.value()) / length_;
  report.world_rms_length = std::sqrt(world_.value()) / length_;
  report.clip_shape_rms_length = std::sqrt(clip_shape_.value()) / length_;
  report.sole_gap_length = sole_gap_.value() / length_;
  report.feedback_rms = std::sqrt(feedback_.value());
  report.correction_rms = std::sqrt(correction_.value());
  report.correction_buzz_rms = std::sqrt(buzz_.value());
  measure_way(report);
  measure_apex(report);
  measure_style(report);
  return report;
}

ReplayCourse ReplayMetrics::course() const {
  ReplayCourse course = course_;
  for (Eigen::VectorXd* values : numbers_of(course)) values->conservativeResize(steps_);
  course.com.conservativeResize(Eigen::NoChange, steps_);
  course.target_com.conservativeResize(Eigen::NoChange, steps_);
  return course;
}

}  // namespace hydrostat::retarget

#include "retarget/replay.h"

#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <map>

namespace hydrostat::retarget {
namespace {

constexpr double kFallSeconds = 0.2, kFallTilt = 50 * M_PI / 180;
constexpr double kGlideReach = 0.04, kGlideLeast = 0.005, kGlideTurn = 0.1, kGlideLeak = 0.3;  // per L, per L; rad; 1/s
constexpr double kGlideSpeed = 0.15;  // of the target's RMS speed: a slow creature is not asked to catch up fast
constexpr double kStillSpeed = 0.01;  // of sqrt(g L): a loaded patch that moves faster slides

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The rotation that takes a's points nearest to b's (Kabsch), both about their weighted means; weights sum to 1.
struct Fit {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d mean_a, mean_b;
  double rms;  // what is left [unit of a]
};

Fit best_fit(const physics::ConstPoints& a, const physics::ConstPoints& b, const Eigen::VectorXd& weights) {
  Fit fit;
  fit.mean_a = a * weights;
  fit.mean_b = b * weights;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const Eigen::Vector3d pa = a.col(i) - fit.mean_a, pb = b.col(i) - fit.mean_b;
    covariance += weights[i] * pb * pa.transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  fit.rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  double squared = 0;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const Eigen::Vector3d pa = a.col(i) - fit.mean_a, pb = b.col(i) - fit.mean_b;
    squared += weights[i] * (fit.rotation * pa - pb).squaredNorm();
  }
  fit.rms = std::sqrt(squared);
  return fit;
}

double yaw_of(const Eigen::Matrix3d& rotation) { return std::atan2(rotation(0, 2) - rotation(2, 0), rotation(0, 0) + rotation(2, 2)); }

/// Slope of the least-squares line through (x, y).
double slope(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() < 2) return 0;
  const double n = static_cast<double>(x.size());
  double mx = 0, my = 0, sxy = 0, sxx = 0;
  for (std::size_t i = 0; i < x.size(); ++i) mx += x[i] / n, my += y[i] / n;
  for (std::size_t i = 0; i < x.size(); ++i) sxy += (x[i] - mx) * (y[i] - my), sxx += (x[i] - mx) * (x[i] - mx);
  return sxx > 0 ? sxy / sxx : 0;
}

/// A rigid move in the plane of the ground by which the reference may follow the body, so that legs never chase far targets.
struct Glide {
  double reach, turn_reach;  // [m], [rad]: errors up to here are corrected, the reference gives way to larger ones
  double x = 0, z = 0, yaw = 0;

  void follow(const Eigen::Vector3d& com_error, double yaw_error, double seconds) {
    const double away = std::hypot(com_error.x() - x, com_error.z() - z);
    if (away > reach) {
      const double share = (away - reach) / away;
      x += share * (com_error.x() - x);
      z += share * (com_error.z() - z);
    }
    double turn = std::remainder(yaw_error - yaw, 2 * M_PI);
    if (std::abs(turn) > turn_reach) yaw += turn - std::copysign(turn_reach, turn);
    const double keep = std::exp(-kGlideLeak * seconds);
    x *= keep, z *= keep, yaw *= keep;
  }
  void apply(const Eigen::Vector3d& com, physics::State& reference) const {
    if (x == 0 && z == 0 && yaw == 0) return;
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    for (Eigen::Index i = 0; i < reference.x.cols(); ++i) {
      const Eigen::Vector3d arm = reference.x.col(i) - com, speed = reference.v.col(i);
      reference.x.col(i) = com + Eigen::Vector3d(x, 0, z) + turn * arm;
      reference.v.col(i) = turn * speed;
    }
  }
};

/// Sums that become the report when the run ends.
struct Tally {
  double shape = 0, clip_shape = 0, world = 0, sole_gap = 0, slip = 0, correction = 0;
  long shapes = 0, clip_shapes = 0, soles = 0, stances = 0, corrections = 0;
  std::vector<double> cycle, drift, heading;
};

/// The velocity [m/s] that all pushes together give between two times: each counts with the share of its duration that lies there.
Eigen::Vector3d pushed_velocity(const std::vector<Push>& pushes, double begin, double end) {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (const Push& push : pushes) {
    const double seconds = std::min(end, push.time_s + push.duration_s) - std::max(begin, push.time_s);
    if (seconds > 0) velocity += seconds / push.duration_s * push.delta_v;
  }
  return velocity;
}

std::string fall_cause(const ReplayInput& input, const physics::State& state, const physics::State& reference, const Fit& fit,
                       const Eigen::VectorXd& activation, double time_s) {
  // The region whose nodes are furthest from where they should be, seen from the body.
  std::map<std::string, std::pair<double, int>> error;
  std::map<std::string, std::pair<int, int>> at_limit;
  const physics::Body& body = input.scene.body;
  for (int e = 0; e < body.edge_count(); ++e) {
    const std::string& bone = input.muscles.edge_bone[static_cast<std::size_t>(e)];
    for (int k = 0; k < 2; ++k) {
      const int i = body.edges(k, e);
      const Eigen::Vector3d seen = fit.rotation * (reference.x.col(i) - fit.mean_a) + fit.mean_b;
      error[bone].first += (state.x.col(i) - seen).norm();
      error[bone].second += 1;
    }
    at_limit[bone].first += std::abs(activation[e] - 1) > 0.999 * input.limit ? 1 : 0;
    at_limit[bone].second += 1;
  }
  std::string worst;
  double largest = -1;
  for (const auto& [bone, sum] : error) {
    const double mean = sum.first / sum.second;
    if (mean > largest) largest = mean, worst = bone;
  }
  const Motion& target = input.prepared.target;
  const long frame = static_cast<long>(time_s * target.rate_hz);
  char text[300];
  std::snprintf(text, sizeof text, "at %.2f s (frame %ld) limb '%s' is %.3f m from its target, %.0f %% of its constraints at the limit of %.2f",
                time_s, target.loop ? frame % target.count() : std::min<long>(frame, target.count() - 1), worst.c_str(), largest,
                100.0 * at_limit[worst].first / std::max(1, at_limit[worst].second), input.limit);
  return text;
}

/// The frame of the plan at a time.
long plan_frame_at(const Motion& target, double time_s) {
  const long frame = static_cast<long>(time_s * target.rate_hz);
  return target.loop ? frame % target.count() : std::min<long>(frame, target.count() - 1);
}

/// 0 where a patch is meant to slide, 1 elsewhere.
double planned_grip(const PreparedTarget& prepared, double time_s) {
  const long frame = plan_frame_at(prepared.target, time_s);
  for (const std::vector<ContactState>& states : prepared.contacts.state) {
    if (states[static_cast<std::size_t>(frame)] == ContactState::kSlide) return 0;
  }
  return 1;
}

}  // namespace

double usual_duration(const Motion& target) {
  if (!target.loop) return target.duration_s() + 1;
  return target.duration_s() * std::max(1.0, std::min(15.0, std::floor(10 / target.duration_s() + 1e-9)));
}

Replay replay(const ReplayInput& input, const ReplayOptions& options) {
  const physics::Scene& scene = input.scene;
  const physics::Body& body = scene.body;
  const Motion& target = input.prepared.target;
  const int nodes = body.node_count(), edges = body.edge_count();
  const double mass = body.mass.sum(), weight = mass * scene.gravity.norm(), length = input.length;
  const Eigen::VectorXd shares = body.mass / mass;
  const double control_s = options.step_s * options.steps_per_control;
  const long steps = std::lround(options.duration_s / control_s);
  const double wave_speed = std::sqrt(scene.gravity.norm() * length);

  const MotionCurve curve(target);
  const MotionCurve clip_curve(input.clip_skin);
  const double period = target.duration_s();
  std::unique_ptr<physics::Stepper> stepper = physics::make_stepper(options.method, scene);
  Corrector corrector(input.model, input.muscles, length, input.limit, options.corrector);
  physics::Impulses impulses = physics::make_impulses(scene);
  physics::State state, reference, glided;
  curve.at(0, state.x, state.v);
  if (!target.loop) state.v.setZero();
  const physics::State start = state;
  const double rest_volume = physics::volume(body, body.rest);
  Eigen::VectorXd feed_forward(edges), activation(edges);
  std::vector<ContactState> touching(static_cast<std::size_t>(scene.contact_points.count()), ContactState::kOff);
  for (std::size_t k = 0; k < touching.size(); ++k) {
    if (input.prepared.contacts.touching(static_cast<Eigen::Index>(k), 0)) touching[k] = ContactState::kStick;
  }
  Eigen::Matrix3Xd effect(3, nodes), contact_sum = Eigen::Matrix3Xd::Zero(3, scene.contact_points.count());

  Replay result;
  ReplayReport& report = result.report;
  const std::size_t patches = input.prepared.contacts.patches.size();
  result.course.patch_state.assign(patches, {});
  std::vector<bool> patch_loaded(patches, false);
  std::vector<double> times, heights, headings, corrections, saturations, volumes, slips;
  std::vector<Eigen::Vector3d> coms, target_coms;
  std::vector<Eigen::VectorXd> frames{Eigen::Map<const Eigen::VectorXd>(state.x.data(), state.x.size())};
  const long per_frame = std::max(1L, std::lround(1 / (target.rate_hz * control_s)));

  Trace& trace = result.trace;
  const auto record = [&](long row, double time) {
    trace.time_s[row] = time;
    trace.position.col(row) = Eigen::Map<const Eigen::VectorXd>(state.x.data(), state.x.size());
    trace.velocity.col(row) = Eigen::Map<const Eigen::VectorXd>(state.v.data(), state.v.size());
    trace.activation.col(row) = activation;
  };
  Eigen::Matrix3Xd contact_nodes = Eigen::Matrix3Xd::Zero(3, nodes), effect_nodes = contact_nodes;
  Eigen::Vector3d contact_moment, effect_moment, gravity_moment;
  if (options.trace) {
    trace.time_s.resize(steps + 1);
    trace.mass_kg = body.mass;
    trace.position.resize(3 * nodes, steps + 1);
    trace.velocity = trace.position;
    trace.contact_force = Eigen::MatrixXd::Zero(3 * nodes, steps + 1);
    trace.effect_force = trace.correction_impulse = trace.contact_force;
    trace.contact_moment = Eigen::Matrix3Xd::Zero(3, steps + 1);
    trace.effect_moment = trace.contact_moment;
    trace.activation.resize(edges, steps + 1);
    trace.edges = body.edges;
    trace.rest_length_m = body.rest_length;
    trace.elements = body.tets;
    input.feed_forward(0, activation);
    record(0, 0);
  }

  const double target_speed = std::sqrt(velocities(target).colwise().squaredNorm().mean() / nodes);
  const double reach = std::clamp(kGlideSpeed * target_speed * options.corrector.settle_s, kGlideLeast * length, kGlideReach * length);
  Glide glide{reach, kGlideTurn * reach / (kGlideReach * length)};
  Tally tally;
  double falling_for = 0, busy_seconds = 0, time = 0, highest = -1e300;
  const Eigen::Vector3d start_com = start.x * shares;
  const double target_rise_from = start_com.y();
  long rows = 1;
  for (long s = 0; s < steps; ++s) {
    const double began = thread_seconds();
    const Eigen::Vector3d before_momentum = physics::momentum(body, state.v);
    const Eigen::Vector3d before_spin = physics::angular_momentum(body, state.x, state.v, Eigen::Vector3d::Zero());
    curve.at(time, reference.x, reference.v);
    const Fit fit = best_fit(reference.x, state.x, shares);
    input.feed_forward(time + 0.5 * control_s, feed_forward);
    activation = feed_forward;
    if (options.correct) {
      glided = reference;
      glide.follow(fit.mean_b - fit.mean_a, yaw_of(fit.rotation), control_s);
      glide.apply(fit.mean_a, glided);
      const double size = corrector.correct(state, glided, touching, planned_grip(input.prepared, time), activation);
      tally.correction += size * size;
      ++tally.corrections;
      corrections.push_back(size);
    } else {
      corrections.push_back(0);
    }
    contact_nodes.setZero();
    effect_nodes.setZero();
    contact_sum.setZero();
    contact_moment.setZero();
    effect_moment.setZero();
    gravity_moment.setZero();
    physics::Termination termination = physics::Termination::kDone;
    for (int k = 0; k < options.steps_per_control && termination == physics::Termination::kDone; ++k) {
      const double begin = time + k * options.step_s;
      const Eigen::Vector3d pushed = pushed_velocity(options.pushes, begin, begin + options.step_s);
      const Eigen::Matrix3Xd* force = nullptr;
      if (!pushed.isZero(0)) {
        effect = (pushed / options.step_s) * body.mass.transpose();
        force = &effect;
      }
      termination = stepper->step(options.step_s, activation, force, state, impulses);
      contact_nodes += impulses.contact_nodes;
      effect_nodes += impulses.effect_nodes;
      contact_sum += impulses.contact;
      contact_moment += impulses.contact_moment;
      effect_moment += impulses.effect_moment;
      gravity_moment += impulses.gravity_moment;
    }
    busy_seconds += thread_seconds() - began;
    time += control_s;
    if (termination == physics::Termination::kDiverged) {
      result.termination = termination;
      report.fell = true;
      report.fall_time_s = time;
      report.fall_cause = "the simulation diverged: " + fall_cause(input, state, reference, fit, activation, time);
      break;
    }

    // The balance of this control step.
    const Eigen::Vector3d change = physics::momentum(body, state.v) - before_momentum - control_s * mass * scene.gravity -
                                   contact_nodes.rowwise().sum() - effect_nodes.rowwise().sum();
    report.momentum_residual_mg = std::max(report.momentum_residual_mg, change.norm() / control_s / weight);
    const Eigen::Vector3d spin = physics::angular_momentum(body, state.x, state.v, Eigen::Vector3d::Zero()) - before_spin -
                                 gravity_moment - contact_moment - effect_moment;
    report.angular_residual_mgl = std::max(report.angular_residual_mgl, spin.norm() / control_s / (weight * length));
    if (options.trace) {
      record(s + 1, time);
      trace.contact_force.col(s + 1) = Eigen::Map<const Eigen::VectorXd>(contact_nodes.data(), contact_nodes.size()) / control_s;
      trace.effect_force.col(s + 1) = Eigen::Map<const Eigen::VectorXd>(effect_nodes.data(), effect_nodes.size()) / control_s;
      trace.contact_moment.col(s + 1) = contact_moment / control_s;
      trace.effect_moment.col(s + 1) = effect_moment / control_s;
    }
    ++rows;
    if ((s + 1) % per_frame == 0) frames.push_back(Eigen::Map<const Eigen::VectorXd>(state.x.data(), state.x.size()));

    // How well it goes.
    curve.at(time, reference.x, reference.v);
    const Fit now = best_fit(reference.x, state.x, shares);
    const Eigen::Vector3d com = now.mean_b, target_com = now.mean_a;
    tally.shape += now.rms * now.rms;
    tally.world += ((state.x - reference.x).colwise().squaredNorm() * shares)(0);
    ++tally.shapes;
    const double yaw = yaw_of(now.rotation), cycle = time / period;
    const Eigen::Vector3d error = com - target_com;
    if (!target.loop || cycle >= 2) {
      tally.cycle.push_back(cycle);
      tally.drift.push_back(std::hypot(error.x(), error.z()));
      tally.heading.push_back(yaw);
    }
    if ((s + 1) % (2 * per_frame) == 0 && (target.loop || time <= period)) {
      Eigen::Matrix3Xd clip_x, clip_v, skin(3, input.skin_points.count());
      clip_curve.at(time, clip_x, clip_v);
      for (int p = 0; p < input.skin_points.count(); ++p) skin.col(p) = input.skin_points.of(state.x, p);
      const Eigen::VectorXd even = Eigen::VectorXd::Constant(skin.cols(), 1.0 / static_cast<double>(skin.cols()));
      const double rms = best_fit(clip_x, skin, even).rms;
      tally.clip_shape += rms * rms;
      ++tally.clip_shapes;
    }
    double lowest = 0;
    for (int p = 0; p < scene.contact_points.count(); ++p) {
      const bool loaded = contact_sum.col(p).norm() > 1e-6 * weight * control_s;
      const Eigen::Vector3d speed = scene.contact_points.of(state.v, p);
      const bool slides = (speed - scene.ground.normal.dot(speed) * scene.ground.normal).norm() > kStillSpeed * wave_speed;
      touching[static_cast<std::size_t>(p)] = !loaded ? ContactState::kOff : slides ? ContactState::kSlide : ContactState::kStick;
      if (loaded) lowest = std::min(lowest, scene.ground.normal.dot(scene.contact_points.of(state.x, p)) - scene.ground.offset);
    }
    report.penetration_max_size = std::max(report.penetration_max_size, -lowest / input.size);
    double slip_speed = 0;
    const long plan_frame = plan_frame_at(target, time);
    for (std::size_t k = 0; k < patches; ++k) {
      const Patch& patch = input.prepared.contacts.patches[k];
      double load = 0, gap = 1e300;
      Eigen::Vector3d moving = Eigen::Vector3d::Zero();
      for (const int p : patch.points) {
        const double force = scene.ground.normal.dot(contact_sum.col(p));
        const Eigen::Vector3d speed = scene.contact_points.of(state.v, p);
        moving += force * (speed - scene.ground.normal.dot(speed) * scene.ground.normal);
        load += force;
        gap = std::min(gap, scene.ground.normal.dot(scene.contact_points.of(state.x, p)) - scene.ground.offset);
      }
      const bool loaded = load > 0.01 * weight * control_s;
      const double speed = loaded ? moving.norm() / load : 0;
      if (loaded) {
        tally.slip += speed * control_s;
        if (!patch_loaded[k]) ++tally.stances;
        slip_speed = std::max(slip_speed, speed);
      }
      patch_loaded[k] = loaded;
      result.course.patch_state[k].push_back(!loaded ? ContactState::kOff : speed > kStillSpeed * wave_speed ? ContactState::kSlide : ContactState::kStick);
      if (input.prepared.contacts.state[k][static_cast<std::size_t>(plan_frame)] == ContactState::kStick) {
        tally.sole_gap += std::max(0.0, gap);
        ++tally.soles;
      }
    }
    const double volume_ratio = physics::volume(body, state.x) / rest_volume;
    report.volume_error_max = std::max(report.volume_error_max, std::abs(volume_ratio - 1));
    highest = std::max(highest, com.y());
    times.push_back(time);
    heights.push_back(com.y());
    headings.push_back(yaw * 180 / M_PI);
    volumes.push_back(volume_ratio);
    slips.push_back(slip_speed);
    saturations.push_back((activation.array() - 1).abs().unaryExpr([&](double a) { return a > 0.999 * input.limit ? 1.0 : 0.0; }).mean());
    coms.push_back(com);
    target_coms.push_back(target_com);

    const double tilt = std::acos(std::clamp(now.rotation(1, 1), -1.0, 1.0));
    const double ground_below = scene.ground.normal.dot(com) - scene.ground.offset;
    const bool down = ground_below < 0.5 * target_com.y() || tilt > kFallTilt;
    falling_for = down ? falling_for + control_s : 0;
    if (falling_for >= kFallSeconds) {
      report.fell = true;
      report.fall_time_s = time - falling_for;
      report.fall_cause = fall_cause(input, state, reference, now, activation, time);
      break;
    }
  }

  report.duration_s = time;
  report.cycles = time / period;
  const double count = static_cast<double>(std::max(1L, tally.shapes));
  report.shape_rms_length = std::sqrt(tally.shape / count) / length;
  report.world_rms_length = std::sqrt(tally.world / count) / length;
  report.clip_shape_rms_length = std::sqrt(tally.clip_shape / static_cast<double>(std::max(1L, tally.clip_shapes))) / length;
  if (target.loop) {
    report.drift_per_cycle_length = slope(tally.cycle, tally.drift) / length;
    // Headings go on beyond half a turn.
    for (std::size_t k = 1; k < tally.heading.size(); ++k) {
      tally.heading[k] = tally.heading[k - 1] + std::remainder(tally.heading[k] - tally.heading[k - 1], 2 * M_PI);
    }
    report.heading_deg_per_cycle = slope(tally.cycle, tally.heading) * 180 / M_PI;
  } else if (!tally.drift.empty()) {
    report.drift_per_cycle_length = tally.drift.back() / length;
  }
  if (!coms.empty()) {
    // Along the clip's own way: over whole cycles of a loop, over all of a one-shot.
    const Eigen::Vector3d clip_way = target.loop ? input.clip_skin.travel
                                                 : Eigen::Vector3d(input.clip_skin.at(input.clip_skin.count() - 1).rowwise().mean() -
                                                                   input.clip_skin.at(0).rowwise().mean());
    Eigen::Vector3d level_way(clip_way.x(), 0, clip_way.z());
    const double way = level_way.norm();
    const double whole = target.loop ? std::max(1.0, std::floor(report.cycles + 1e-6)) : 1;
    const std::size_t last = target.loop ? std::min(coms.size() - 1, static_cast<std::size_t>(std::lround(whole * period / control_s)) - 1) : coms.size() - 1;
    const Eigen::Vector3d gone = coms[last] - start_com;
    report.clip_travel_per_cycle_length = way / length;
    report.travel_per_cycle_length = (way > 1e-9 ? gone.dot(level_way) / way : std::hypot(gone.x(), gone.z())) / whole / length;
  }
  report.slip_per_stance_length = tally.slip / static_cast<double>(std::max(1L, tally.stances)) / length;
  report.sole_gap_length = tally.soles > 0 ? tally.sole_gap / static_cast<double>(tally.soles) / length : 0;
  report.correction_rms = tally.corrections > 0 ? std::sqrt(tally.correction / static_cast<double>(tally.corrections)) : 0;
  report.real_time_factor = busy_seconds > 0 ? time / busy_seconds : 0;
  report.apex_rise_length = (highest - target_rise_from) / length;
  double clip_highest = -1e300;
  for (Eigen::Index f = 0; f < input.clip_skin.count(); ++f) clip_highest = std::max(clip_highest, input.clip_skin.at(f).row(1).mean());
  report.clip_apex_rise_length = (clip_highest - input.clip_skin.at(0).row(1).mean()) / length;
  const Eigen::VectorXd jacobian = physics::jacobians(body, state.x);
  report.inverted_elements = static_cast<int>((jacobian.array() <= 0).count());

  result.motion.rate_hz = target.rate_hz;
  result.motion.frames.resize(3 * nodes, static_cast<Eigen::Index>(frames.size()));
  for (std::size_t f = 0; f < frames.size(); ++f) result.motion.frames.col(static_cast<Eigen::Index>(f)) = frames[f];
  const auto column = [](const std::vector<double>& values) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
  };
  ReplayCourse& course = result.course;
  course.time_s = column(times);
  course.height = column(heights);
  course.heading_deg = column(headings);
  course.correction = column(corrections).head(static_cast<Eigen::Index>(times.size()));
  course.saturated = column(saturations);
  course.volume_ratio = column(volumes);
  course.slip_speed = column(slips);
  course.com.resize(3, static_cast<Eigen::Index>(coms.size()));
  course.target_com = course.com;
  for (std::size_t k = 0; k < coms.size(); ++k) {
    course.com.col(static_cast<Eigen::Index>(k)) = coms[k];
    course.target_com.col(static_cast<Eigen::Index>(k)) = target_coms[k];
  }
  if (options.trace && rows < steps + 1) {
    trace.time_s.conservativeResize(rows);
    for (Eigen::MatrixXd* m : {&trace.position, &trace.velocity, &trace.contact_force, &trace.effect_force, &trace.correction_impulse, &trace.activation}) {
      m->conservativeResize(Eigen::NoChange, rows);
    }
    trace.contact_moment.conservativeResize(Eigen::NoChange, rows);
    trace.effect_moment.conservativeResize(Eigen::NoChange, rows);
  }
  return result;
}

}  // namespace hydrostat::retarget

#include "retarget/polish.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr int kMostFailures = 2;  // to halve the gain for
constexpr double kRidge = 1e-10;  // per mean square of the basis: its constant and its mean are the same twice

/// The coefficients (basis x C) that come closest to `columns` (C x S) at the phases (S).
Eigen::MatrixXd fitted(const signal::Basis& basis, const Eigen::VectorXd& phases, const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd values(basis.size(), phases.size());
  for (Eigen::Index s = 0; s < phases.size(); ++s) basis.fill_values(phases[s], values.col(s));
  Eigen::MatrixXd normal = values * values.transpose();
  normal.diagonal().array() += kRidge * normal.diagonal().maxCoeff();
  return normal.ldlt().solve(values * columns.transpose());
}

/// The settled part of a lesson.
struct Settled {
  Eigen::Index first, count;
};

Settled settled_part(const Lesson& lesson, const SignalSet& signals, const PolishOptions& options) {
  const Eigen::Index steps = lesson.time_s.size();
  if (signals.kind() == signal::Kind::one_shot) return {0, steps};
  const double per_cycle = signals.period_s / (lesson.time_s[1] - lesson.time_s[0]);
  const double cycles = std::floor(static_cast<double>(steps) / per_cycle + 1e-6);
  const double skipped = std::floor(std::min(options.settled_cycles, 0.4 * cycles));
  const auto first = static_cast<Eigen::Index>(std::lround(skipped * per_cycle));
  return {first, static_cast<Eigen::Index>(std::lround(cycles * per_cycle)) - first};
}

void fold_activations(const Lesson& lesson, const Settled& part, double gain, SignalSet& signals) {
  const double step_s = lesson.time_s[1] - lesson.time_s[0];
  Eigen::VectorXd phases = (lesson.time_s.segment(part.first, part.count).array() + 0.5 * step_s) / signals.period_s;
  Eigen::Index count = part.count;
  if (signals.kind() == signal::Kind::one_shot) {
    while (count > 0 && phases[count - 1] > 1) --count;
  }
  const signal::Basis basis = signal::basis_of(signals.activation);
  const Eigen::MatrixXd change = gain * fitted(basis, phases.head(count), lesson.added.middleCols(part.first, count));
  const int rows = basis.harmonics + 1;
  signals.activation.cosine += change.topRows(rows);
  (signals.kind() == signal::Kind::loop ? signals.activation.sine : signals.activation.cubic) += change.bottomRows(change.rows() - rows);
  if (signals.kind() == signal::Kind::loop) signals.activation.sine.row(0).setZero();
}

/// What of a course repeats itself, on even times of one period; of one run all of it.
Motion repeated(const Eigen::MatrixXd& course, const Lesson& lesson, const Settled& part, const Motion& target) {
  Motion result;
  const double step_s = lesson.time_s[1] - lesson.time_s[0];
  result.loop = target.loop;
  result.rate_hz = 1 / step_s;
  result.frames = course;
  if (!target.loop) return result;
  const double period = target.duration_s();
  const int samples = static_cast<int>(std::lround(period / step_s));
  signal::Basis basis{signal::Kind::loop, samples, (samples - 1) / 2};
  const Eigen::VectorXd phases = lesson.time_s.segment(part.first, part.count) / period;
  const Eigen::MatrixXd coefficients = fitted(basis, phases, course.middleCols(part.first, part.count));
  Eigen::VectorXd values(basis.size());
  result.yaw = target.yaw;
  result.rate_hz = samples / period;
  result.frames.resize(course.rows(), samples);
  for (int s = 0; s < samples; ++s) {
    basis.fill_values(static_cast<double>(s) / samples, values);
    result.frames.col(s) = coefficients.transpose() * values;
  }
  return result;
}

void fold_path(const Lesson& lesson, const Settled& part, double gain, const Motion& target, NominalPath& path) {
  Motion place = repeated(lesson.place, lesson, part, target), velocity = repeated(lesson.velocity, lesson, part, target);
  place.frames *= gain;
  velocity.frames *= gain;
  if (path.is_empty()) {
    path.place = place;
    path.velocity = velocity;
    return;
  }
  path.place.frames += place.frames;
  path.velocity.frames += velocity.frames;
}

/// The forces that go with what the activations and the path have become.
void carry_forces(const Performer& performer, const SignalSet& before, const NominalPath& path_before, SignalSet& after,
                  const NominalPath& path) {
  const int n = after.samples();
  const auto forces = [&](const SignalSet& set, const NominalPath& of) {
    const MotionCurve target(performer.prepared.target);
    NominalPathCurve offset(of);
    physics::State state;
    Eigen::MatrixXd lengths(n, set.count());
    for (int f = 0; f < n; ++f) {
      const double time_s = f / set.rate_hz();
      target.at(time_s, state.x, state.v);
      offset.apply(time_s, state);
      for (int e = 0; e < set.count(); ++e) lengths(f, e) = (state.x.col(set.nodes(1, e)) - state.x.col(set.nodes(0, e))).norm();
    }
    return penalty_forces(signal::synthesise_samples(set.activation, n), lengths, set.rest_length, set.stiffness);
  };
  const signal::Spectrum change = signal::analyse(after.kind(), forces(after, path) - forces(before, path_before), after.force.harmonics());
  after.force.cosine += change.cosine;
  after.force.sine += change.sine;
  after.force.cubic += change.cubic;
}

/// One state of what is learned, with the replay that it led to.
struct Round {
  SignalSet signals;
  Performer performer;
  Lesson lesson;
  ReplayReport report;

  void play(const PerformOptions& options) {
    PerformOptions alone = options;
    alone.baselines = false;
    alone.closed_loop = true;
    alone.replay.trace = false;
    alone.replay.lesson = &lesson;
    const Replay run = *perform(performer, signals, alone).closed_loop;
    report = run.report;
    report.fell = report.fell || run.termination == physics::Termination::kDiverged;
  }
  void learn(const PolishOptions& options, double gain) {
    const Settled part = settled_part(lesson, signals, options);
    fold_activations(lesson, part, gain, signals);
    fold_path(lesson, part, gain, performer.prepared.target, performer.path);
  }
};

double lasting(const SignalSet& signals, double most_s, double cycles) {
  return signals.kind() == signal::Kind::loop ? std::min(most_s, cycles * signals.period_s) : most_s;
}

}  // namespace

Polished polish(const Performer& performer, const SignalSet& signals, const PerformOptions& options, const PolishOptions& polish) {
  Polished result;
  result.signals = signals;
  result.path = performer.path;
  PerformOptions replays = options;
  replays.replay.duration_s = lasting(signals, options.replay.duration_s, polish.first_cycles);
  Round best{signals, performer, {}, {}};
  best.signals.layers.clear();
  best.play(replays);
  PolishReport& report = result.report;
  report.correction_rms_before = report.correction_rms_after = best.report.correction_rms;
  if (best.report.fell) return result;
  const double most_shape = best.report.shape_rms_length + polish.most_shape;
  const double enough = polish.enough * report.correction_rms_before;
  replays.replay.duration_s = lasting(signals, options.replay.duration_s, polish.cycles);
  double gain = polish.gain;
  int failures = 0;
  bool has_settled = false;
  while (report.rounds < polish.most_rounds && best.report.correction_rms > enough && failures < kMostFailures && !has_settled) {
    Round next = best;
    next.learn(polish, gain);
    next.play(replays);
    ++report.rounds;
    const bool is_sound = !next.report.fell && next.report.shape_rms_length <= most_shape;
    const double share = next.report.correction_rms / best.report.correction_rms;
    if (is_sound && share < 1) {
      best = std::move(next);
      has_settled = share > 1 - polish.least_fall;
    } else {
      ++failures;
      gain /= 2;
    }
  }
  if (report.rounds == 0 || best.report.correction_rms >= report.correction_rms_before) return result;
  PerformOptions trials = options;
  trials.replay.trace = false;
  SignalSet without_layers = signals;
  without_layers.layers.clear();
  const Act solved(performer, without_layers), polished(best.performer, best.signals);
  for (const std::span<const Trial> bodies : {std::span<const Trial>(kTrials), std::span<const Trial>(polish.more_trials)}) {
    if (bodies.empty()) continue;
    result.solved_on_trials = go_on_trials(solved, trials, bodies);
    result.polished_on_trials = go_on_trials(polished, trials, bodies);
    const double most_shape_of_all = polish.most_on_trials * result.solved_on_trials.shape_rms_length + polish.most_shape;
    result.is_frail = result.polished_on_trials.lost > result.solved_on_trials.lost || !(result.polished_on_trials.shape_rms_length <= most_shape_of_all);
    if (result.is_frail) return result;
  }
  report.correction_rms_after = best.report.correction_rms;
  SignalSet learned = std::move(best.signals);
  carry_forces(performer, signals, performer.path, learned, best.performer.path);
  learned.layers = signals.layers;
  result.signals = std::move(learned);
  result.path = std::move(best.performer.path);
  return result;
}

}  // namespace hydrostat::retarget

#include "retarget/performance.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>

#include "physics/element_body.h"
#include "retarget/sag.h"

namespace hydrostat::retarget {
namespace {

constexpr double kErrorSeconds = 1;  // at most, over which the substep's error is measured
constexpr double kOffPlace = 0.05;     // of L (RMS), from which a clip that stays where it is has lost its place
constexpr double kOffTurn = 0.3;       // [deg], by which what is played once ends turned
constexpr double kOffTravel = 0.08;    // of it, more or less, from which its way is lost
constexpr double kOffDrift = 0.04;     // likewise of drift a cycle: measured, what is well drifts by 1.3 % at most, what staggers by 5 % and more
constexpr double kLeastCycles = 4;     // of a loop, which tell its drift
constexpr double kLookSeconds = 6;     // at most, for which bodies off the plan go where the planned one keeps its way
constexpr double kCircle = 10 * M_PI / 180;  // by which a clip turns before its way ends elsewhere than it led to
// Tried in this order. The regulator keeps nearest to the path; where it leaves large errors to the corrector more pushes are recovered, but
// some bodies are lost that it holds alone. The quick ones keep bodies up whose feet slide under the usual gain.
constexpr Feedback kOthers[] = {{},
                                {.regulator = 1e-3},
                                {.regulator = 1e-2},
                                {.regulator = 1},
                                {.effort = 1, .horizon = 0.6, .root_weight = 4.0 / 3},
                                {.effort = 1, .horizon = 0.5, .root_weight = 10.0 / 3},
                                {.effort = 4, .horizon = 1, .root_weight = 1},
                                {.effort = 16, .horizon = 1, .root_weight = 1},
                                {.effort = 64, .horizon = 1, .root_weight = 1}};

using FeedForward = std::function<void(double, Eigen::VectorXd&)>;

FeedForward signals_of(const SignalSet& signals) {
  const auto player = std::make_shared<signal::Synthesiser>(activations(signals));
  return [player](double time_s, Eigen::VectorXd& activation) { player->at(time_s, activation); };
}

/// The target's lengths as rest lengths, within the limit.
FeedForward target_lengths(const Performer& performer, double limit) {
  const auto curve = std::make_shared<MotionCurve>(performer.prepared.target);
  const auto x = std::make_shared<Eigen::Matrix3Xd>(), v = std::make_shared<Eigen::Matrix3Xd>();
  const physics::Body& body = performer.scene.body;
  return [curve, x, v, &body, limit](double time_s, Eigen::VectorXd& activation) {
    curve->at(time_s, *x, *v);
    for (int e = 0; e < body.edge_count(); ++e) {
      const double length = (x->col(body.edges(1, e)) - x->col(body.edges(0, e))).norm();
      activation[e] = std::clamp(length / body.rest_length[e], 1 - limit, 1 + limit);
    }
  };
}

/// The options with what the performer's world does to it.
ReplayOptions in_world(const Performer& performer, const ReplayOptions& options) {
  ReplayOptions result = options;
  result.pushes.insert(result.pushes.end(), performer.world.pushes.begin(), performer.world.pushes.end());
  result.moves = performer.world.moves;
  return result;
}

std::optional<physics::Scene> without_obstacles(const physics::Scene& scene) {
  if (scene.obstacles.empty()) return std::nullopt;
  std::optional<physics::Scene> result(scene);
  result->obstacles.clear();
  return result;
}

/// Whether what the creature goes through is what its clip was solved for.
bool is_as_planned(const Performer& performer, const ReplayOptions& options) {
  const Eigen::Vector3d& gravity = performer.scene.gravity;
  const bool is_level = gravity.x() == 0 && gravity.z() == 0;
  return is_level && !performer.world.is_told() && performer.scene.obstacles.empty() && options.pushes.empty();
}

/// A body on trial, by the options' feedback.
Replay run_trial(const Trial& trial, const Act& act, const PerformOptions& options) {
  ReplayOptions shoved = options.replay;
  shoved.correct = true;
  shoved.trace = false;
  shoved.lesson = nullptr;
  shoved.corrector = with(options.feedback, options.replay.corrector);
  Push& shove = shoved.pushes.emplace_back();
  shove.delta_v = kTrialShove * Eigen::Vector3d(std::cos(trial.angle), 0, std::sin(trial.angle));
  return act.run(varied_scene(act.performer().scene, trial.body), shoved);
}

Lapse lapse_of(double straying) {
  if (straying == HUGE_VAL) return Lapse::kFell;
  return straying > 1 ? Lapse::kLostWay : Lapse::kNothing;
}

/// Whether a body off the plan falls, or loses the way of its loop; where a single run ends hangs on the body, within a few per cent of L.
bool is_lost(const Performer& performer, const PerformOptions& options, const Replay& run) {
  if (run.report.fell || run.termination != physics::Termination::kDone) return true;
  if (performer.prepared.target.loop) return straying(performer, options.replay, run) > 1;
  return is_as_planned(performer, options.replay) && run.report.drift_per_cycle_length > kOffPlace;
}

/// Which of kTrials are lost.
using Lost = std::array<bool, kTrials.size()>;

int count(const Lost& lost) { return static_cast<int>(std::count(lost.begin(), lost.end(), true)); }

/// Two bodies, side by side.
std::array<Replay, 2> run_pair(const std::array<Trial, 2>& trials, const Act& act, const PerformOptions& options) {
  const auto go = [&](const Trial& trial) { return run_trial(trial, act, options); };
  auto beside = std::async(options.threads > 1 ? std::launch::async : std::launch::deferred, go, trials[0]);
  Replay second = go(trials[1]);
  return {beside.get(), std::move(second)};
}

/// Sets in `lost` which of these two are.
void find_lost(const std::array<std::size_t, 2>& which, const Act& act, const PerformOptions& options, Lost& lost) {
  const std::array<Replay, 2> runs = run_pair({kTrials[which[0]], kTrials[which[1]]}, act, options);
  for (std::size_t k = 0; k < runs.size(); ++k) lost[which[k]] = is_lost(act.performer(), options, runs[k]);
}

/// Which of kTrials are lost, those first that were lost before; the rest are left out once so many are that it is no better.
Lost lost_on_trials(const Act& act, const PerformOptions& options, const Lost& before, int no_better) {
  std::array<std::size_t, kTrials.size()> order;
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_partition(order.begin(), order.end(), [&](std::size_t k) { return before[k]; });
  Lost lost{};
  for (std::size_t k = 0; k < order.size() && count(lost) < no_better; k += 2) find_lost({order[k], order[k + 1]}, act, options, lost);
  return lost;
}

/// Where the planned body keeps its way and some of kTrials do not: the regulator on which fewest of them are lost, if those are fewer.
void keep_more_bodies(const Act& act, const PerformOptions& options, Performances& result) {
  PerformOptions on_trial = options, other = options;
  on_trial.replay.duration_s = std::min(options.replay.duration_s, kLookSeconds);
  other.baselines = false;
  Lost least = lost_on_trials(act, on_trial, {}, static_cast<int>(kTrials.size()) + 1);
  for (const Feedback& feedback : kOthers) {
    if (feedback.regulator == 0 || feedback == options.feedback) continue;  // others are for feet that the usual gain shakes loose
    if (count(least) == 0) break;
    on_trial.feedback = other.feedback = feedback;
    const Lost lost = lost_on_trials(act, on_trial, least, count(least));
    if (count(lost) >= count(least)) continue;
    Performances next = perform(act, other);
    if (straying(act.performer(), options.replay, next.main()) > 1) continue;
    least = lost;
    result.closed_loop = std::move(next.closed_loop);
    result.feedback = feedback;
  }
  result.trials_lost = count(least);
}

}  // namespace

Act::Act(const Performer& performer, const SignalSet& signals)
    : performer_(performer),
      signals_(signals),
      without_obstacles_(without_obstacles(performer.scene)),
      model_(without_obstacles_ ? *without_obstacles_ : performer.scene),
      costs_({model_, performer.muscles, performer.prepared, performer.path, signals_of(signals), performer.length}) {}

ReplayInput Act::input(const physics::Scene& plant) const {
  return {plant, model_, performer_.prepared, performer_.muscles, {}, performer_.clip_points, performer_.scene.contact_points,
          performer_.clip_rise, performer_.length, performer_.size, signals_.limit};
}

Replay Act::run(const physics::Scene& plant, const ReplayOptions& options) const {
  ReplayInput by_signals = input(plant);
  by_signals.feed_forward = signals_of(signals_);
  by_signals.path = &performer_.path;
  by_signals.costs = &costs_;
  by_signals.answers = &answers_;
  return replay(by_signals, in_world(performer_, options));
}

Replay Act::run_naively(const physics::Scene& plant, const ReplayOptions& options) const {
  ReplayInput by_lengths = input(plant);
  by_lengths.feed_forward = target_lengths(performer_, signals_.limit);
  return replay(by_lengths, in_world(performer_, options));
}

Variation variation_of(unsigned seed, double most) {
  if (seed == 0) return {};
  std::mt19937 generator(seed);
  const auto factor = [&generator, most] { return 1 + most * (2 * (static_cast<double>(generator()) / 4294967295.0) - 1); };
  Variation variation;
  variation.mass = factor();
  variation.friction = factor();
  variation.stiffness = factor();
  return variation;
}

std::vector<Trial> drawn_trials(int count, unsigned first_seed) {
  std::vector<Trial> trials;
  for (int k = 0; k < count; ++k) {
    trials.push_back({variation_of(first_seed + static_cast<unsigned>(k), kTrialVariation), 2 * std::numbers::pi * (k + 0.5) / count});
  }
  return trials;
}

physics::Scene varied_scene(const physics::Scene& scene, const Variation& variation) {
  physics::Scene varied = scene;
  varied.body.mass *= variation.mass;
  varied.ground.friction *= variation.friction;
  stiffen(variation.stiffness, varied.body);
  for (physics::BodyElements<3>& elements : varied.body.elements) {
    physics::ElementMesh<3> mesh = physics::mesh_of(varied.body, elements);
    for (physics::ElementMaterial& material : mesh.materials) material.density *= variation.mass;
    elements = physics::make_body_elements(mesh, elements.block.law);
  }
  return varied;
}

Performances perform(const Act& act, const PerformOptions& options) {
  const physics::Scene plant = varied_scene(act.performer().scene, variation_of(options.seed, options.variation));
  ReplayOptions baseline = options.replay;
  baseline.correct = baseline.trace = false;
  baseline.lesson = nullptr;
  Performances result;
  const auto run_baselines = [&] {
    if (!options.baselines) return;
    result.naive = act.run_naively(plant, baseline);
    if (options.closed_loop) result.open_loop = act.run(plant, baseline);
  };
  auto beside = std::async(options.threads > 1 ? std::launch::async : std::launch::deferred, run_baselines);
  ReplayOptions main = options.replay;
  main.correct = options.closed_loop;
  main.corrector = with(options.feedback, options.replay.corrector);
  result.feedback = options.feedback;
  (options.closed_loop ? result.closed_loop : result.open_loop) = act.run(plant, main);
  beside.get();
  return result;
}

Performances perform(const Performer& performer, const SignalSet& signals, const PerformOptions& options) {
  return perform(Act(performer, signals), options);
}

bool travels(const ReplayReport& run) { return run.clip_travel_per_cycle_length >= kLeastTravel; }

double off_place(const ReplayReport& run) {
  return std::sqrt(std::max(0.0, run.world_rms_length * run.world_rms_length - run.shape_rms_length * run.shape_rms_length));
}

double straying(const Performer& performer, const ReplayOptions& options, const Replay& run) {
  const ReplayReport& report = run.report;
  const Motion& target = performer.prepared.target;
  const double way = report.clip_travel_per_cycle_length;
  if (report.fell || run.termination != physics::Termination::kDone) return HUGE_VAL;
  if (!is_as_planned(performer, options) || report.cycles < 1 - 1e-6) return 0;
  const double turn = target.loop ? 0 : std::abs(report.heading_deg_per_cycle) / kOffTurn;
  if (!travels(report)) return std::max(off_place(report) / kOffPlace, turn);
  const bool is_circle = std::abs(target.yaw) * report.cycles > kCircle;
  const bool tells_drift = !target.loop || report.cycles > kLeastCycles - 1e-6;
  const double travel = is_circle ? 0 : std::abs(report.travel_per_cycle_length - way) / (kOffTravel * way);
  const double drift = tells_drift ? report.drift_per_cycle_length / (kOffDrift * way) : 0;
  return std::max({travel, drift, turn});
}

Lapse lapse_of(const Performer& performer, const ReplayOptions& options, const Replay& run) {
  return lapse_of(straying(performer, options, run));
}

TrialsOutcome go_on_trials(const Act& act, const PerformOptions& options, std::span<const Trial> trials) {
  TrialsOutcome result;
  result.bodies = static_cast<int>(trials.size());
  const auto take = [&](const Replay& run) {
    if (is_lost(act.performer(), options, run)) ++result.lost;
    result.shape_rms_length += run.report.shape_rms_length / result.bodies;
  };
  for (std::size_t first = 0; first + 1 < trials.size(); first += 2) {
    for (const Replay& run : run_pair({trials[first], trials[first + 1]}, act, options)) take(run);
  }
  if (trials.size() % 2 == 1) take(run_trial(trials.back(), act, options));
  return result;
}

TrialsOutcome go_on_trials(const Performer& performer, const SignalSet& signals, const PerformOptions& options, std::span<const Trial> trials) {
  return go_on_trials(Act(performer, signals), options, trials);
}

Performances perform_steadily(const Act& act, const PerformOptions& options) {
  Performances result = perform(act, options);
  if (!options.closed_loop) return result;
  const Performer& performer = act.performer();
  double least = straying(performer, options.replay, result.main());
  result.wished_lapse = lapse_of(least);
  if (least <= 1) {
    if (options.is_thorough) keep_more_bodies(act, options, result);
    return result;
  }
  PerformOptions other = options;
  other.baselines = false;
  Lost least_lost{};
  for (const Feedback& feedback : kOthers) {
    const bool is_well = least <= 1;
    if (is_well && count(least_lost) == 0) break;
    if (feedback == options.feedback || (feedback.regulator > 0 && !options.is_thorough)) continue;
    other.feedback = feedback;
    Performances next = perform(act, other);
    const double its = straying(performer, options.replay, next.main());
    if (its > 1 && (is_well || its >= kBetter * least)) continue;
    const int no_better = is_well ? count(least_lost) : static_cast<int>(kTrials.size()) + 1;
    const Lost lost = its <= 1 && options.is_thorough ? lost_on_trials(act, other, least_lost, no_better) : Lost{};
    if (is_well && count(lost) >= count(least_lost)) continue;
    least = its;
    least_lost = lost;
    result.closed_loop = std::move(next.closed_loop);
    result.feedback = feedback;
  }
  result.trials_lost = count(least_lost);
  result.lapse = lapse_of(least);
  return result;
}

Performances perform_steadily(const Performer& performer, const SignalSet& signals, const PerformOptions& options) {
  return perform_steadily(Act(performer, signals), options);
}

double substep_error(const Performer& performer, const SignalSet& signals, const ReplayOptions& options) {
  ReplayOptions coarse = options;
  coarse.correct = coarse.trace = false;
  coarse.lesson = nullptr;
  coarse.duration_s = std::min(performer.prepared.target.duration_s(), kErrorSeconds);
  const double substep = physics::make_stepper(options.method, performer.scene)->substep(options.step_s);
  const int halves = 2 * static_cast<int>(std::lround(options.step_s / substep));
  ReplayOptions fine = coarse;
  fine.step_s = options.step_s / halves;
  fine.steps_per_control = options.steps_per_control * halves;
  const Act act(performer, signals);
  const Replay a = act.run(performer.scene, coarse), b = act.run(performer.scene, fine);
  const Eigen::Index frames = std::min(a.motion.count(), b.motion.count());
  const double nodes = static_cast<double>(a.motion.frames.rows()) / 3 * static_cast<double>(frames);
  return (a.motion.frames.leftCols(frames) - b.motion.frames.leftCols(frames)).norm() / std::sqrt(nodes) / performer.length;
}

}  // namespace hydrostat::retarget

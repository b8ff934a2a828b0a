#include "retarget/performance.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <memory>
#include <random>

#include "physics/element_body.h"

namespace hydrostat::retarget {
namespace {

constexpr double kErrorSeconds = 1;  // at most, over which the substep's error is measured

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

Replay run(const Performer& performer, const physics::Scene& plant, const FeedForward& feed_forward, double limit,
           const ReplayOptions& options, const NominalPath* path = nullptr) {
  std::optional<physics::Scene> without_obstacles;
  if (!performer.scene.obstacles.empty()) without_obstacles.emplace(performer.scene).obstacles.clear();
  const physics::Scene& model = without_obstacles ? *without_obstacles : performer.scene;
  const ReplayInput input{plant,        model,                 performer.prepared,
                          performer.muscles, feed_forward,     performer.clip_points,
                          performer.scene.contact_points, performer.clip_rise, performer.length,
                          performer.size, limit, path};
  ReplayOptions in_world = options;
  in_world.pushes.insert(in_world.pushes.end(), performer.world.pushes.begin(), performer.world.pushes.end());
  in_world.moves = performer.world.moves;
  return replay(input, in_world);
}

}  // namespace

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

physics::Scene varied_scene(const physics::Scene& scene, const Variation& variation) {
  physics::Scene varied = scene;
  varied.body.mass *= variation.mass;
  varied.ground.friction *= variation.friction;
  varied.body.edge_stiffness *= variation.stiffness;
  varied.body.volume_stiffness *= variation.stiffness;
  varied.body.edge_damping *= variation.stiffness;
  for (physics::BodyElements<3>& elements : varied.body.elements) {
    physics::ElementMesh<3> mesh = physics::mesh_of(varied.body, elements);
    for (physics::ElementMaterial& material : mesh.materials) {
      material.density *= variation.mass;
      material.youngs_modulus *= variation.stiffness;
    }
    elements = physics::make_body_elements(mesh, elements.block.law);
  }
  return varied;
}

Performances perform(const Performer& performer, const SignalSet& signals, const PerformOptions& options) {
  const physics::Scene plant = varied_scene(performer.scene, variation_of(options.seed, options.variation));
  ReplayOptions baseline = options.replay;
  baseline.correct = baseline.trace = false;
  baseline.lesson = nullptr;
  Performances result;
  const auto run_baselines = [&] {
    if (!options.baselines) return;
    result.naive = run(performer, plant, target_lengths(performer, signals.limit), signals.limit, baseline);
    if (options.closed_loop) result.open_loop = run(performer, plant, signals_of(signals), signals.limit, baseline, &performer.path);
  };
  auto beside = std::async(options.threads > 1 ? std::launch::async : std::launch::deferred, run_baselines);
  ReplayOptions main = options.replay;
  main.correct = options.closed_loop;
  (options.closed_loop ? result.closed_loop : result.open_loop) = 
      run(performer, plant, signals_of(signals), signals.limit, main, &performer.path);
  beside.get();
  return result;
}

Performances perform_calmly(const Performer& performer, const SignalSet& signals, const PerformOptions& options) {
  Performances result = perform(performer, signals, options);
  PerformOptions calmer = options;
  calmer.baselines = false;
  const auto is_up = [](const Performances& runs) {
    return !runs.main().report.fell && runs.main().termination == physics::Termination::kDone;
  };
  for (const double factor : {4.0, 16.0, 64.0}) {
    if (!options.closed_loop || is_up(result)) break;
    calmer.replay.corrector.effort = factor * options.replay.corrector.effort;
    Performances next = perform(performer, signals, calmer);
    if (!is_up(next)) continue;
    result.closed_loop = std::move(next.closed_loop);
    result.effort = factor;
  }
  return result;
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
  const Replay a = run(performer, performer.scene, signals_of(signals), signals.limit, coarse, &performer.path);
  const Replay b = run(performer, performer.scene, signals_of(signals), signals.limit, fine, &performer.path);
  const Eigen::Index frames = std::min(a.motion.count(), b.motion.count());
  const double nodes = static_cast<double>(a.motion.frames.rows()) / 3 * static_cast<double>(frames);
  return (a.motion.frames.leftCols(frames) - b.motion.frames.leftCols(frames)).norm() / std::sqrt(nodes) / performer.length;
}

}  // namespace hydrostat::retarget

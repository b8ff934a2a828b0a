#include "retarget/performed_scenario.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace hydrostat::retarget {

SignalSet with_harmonics(const SignalSet& signals, int harmonics) {
  SignalSet fewer = signals;
  fewer.activation = signal::truncated(fewer.activation, harmonics, SignalOptions().roll_off);
  fewer.force = signal::truncated(fewer.force, harmonics, SignalOptions().roll_off);
  return fewer;
}

ScenarioOf<3> undriven_scenario(const Performer& performer) {
  ScenarioOf<3> scenario;
  scenario.scene = performer.scene;
  scenario.pushes = performer.world.pushes;
  scenario.moves = performer.world.moves;
  scenario.decisions = performer.world.decisions;
  scenario.length = performer.length;
  scenario.size = performer.size;
  scenario.self_contact_reason = performer.self_contact_reason;
  MotionCurve(performer.prepared.target).at(0, scenario.start.x, scenario.start.v);
  if (!performer.prepared.target.loop) scenario.start.v.setZero();
  return scenario;
}

ScenarioOf<3> performed_scenario(const Performer& performer, const SignalSet& signals, int harmonics) {
  ScenarioOf<3> scenario = undriven_scenario(performer);
  MotionCurve(performer.prepared.target).at(0, scenario.start.x, scenario.start.v);
  const bool is_cut = harmonics > 0 && harmonics < signals.activation.harmonics();
  const auto player =
      std::make_shared<signal::Synthesiser>(activations(is_cut ? with_harmonics(signals, harmonics) : signals));
  scenario.drive = [player](double time_s, Eigen::VectorXd& activation) { player->at(time_s, activation); };
  return scenario;
}

ReferenceOf<3> performed_reference(const Performer& performer, const SignalSet& signals, const AccuracyOptions& options,
                                   bool is_checked) {
  const ScenarioOf<3> scenario = performed_scenario(performer, signals);
  const Motion& target = performer.prepared.target;
  const MotionCurve curve(target);
  const double window_s = options.frame_s * std::max(1.0, std::round(options.window_s / options.frame_s));
  const double span = target.loop ? target.duration_s() : std::max(0.0, target.duration_s() - window_s);
  std::vector<WindowOf<3>> windows;
  for (int k = 0; k < options.windows; ++k) {
    WindowOf<3> window{span * k / options.windows, window_s, scenario.start};
    curve.at(window.begin_s, window.start.x, window.start.v);
    windows.push_back(std::move(window));
  }
  const physics::ContactPointsOf<3> skin{performer.embedding.nodes, performer.embedding.weights};
  return make_reference<3>(scenario, options, std::move(windows), skin, is_checked);
}

AccuracyRow measure_level(const ReferenceOf<3>& reference, const Performer& level, const SignalSet& signals,
                          const StepSetting& setting) {
  const MotionCurve curve(level.prepared.target);
  std::vector<WindowOf<3>> windows = reference.windows;
  for (WindowOf<3>& window : windows) curve.at(window.begin_s, window.start.x, window.start.v);
  return measure_error(reference, performed_scenario(level, signals), setting, windows,
                       physics::ContactPointsOf<3>{level.embedding.nodes, level.embedding.weights});
}

Replay perform_briefly(const Performer& performer, const SignalSet& signals, const ReplayOptions& options) {
  const Motion& target = performer.prepared.target;
  PerformOptions perform_options;
  perform_options.replay = options;
  perform_options.replay.duration_s = std::min(usual_duration(target), std::clamp(2 * target.duration_s(), 2.0, 4.0));
  perform_options.baselines = false;
  return *perform(performer, signals, perform_options).closed_loop;
}

double skin_distance(const Performer& of_a, const Motion& a, const Performer& of_b, const Motion& b) {
  const Eigen::Index frames = std::min(a.count(), b.count());
  double sum = 0;
  for (Eigen::Index f = 0; f < frames; ++f)
    sum += (embedded_positions(of_a.embedding, a.at(f)) - embedded_positions(of_b.embedding, b.at(f))).squaredNorm();
  return std::sqrt(sum / static_cast<double>(frames * of_a.embedding.count()));
}

}  // namespace hydrostat::retarget

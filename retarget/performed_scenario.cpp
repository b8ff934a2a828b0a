#include "retarget/performed_scenario.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace hydrostat::retarget {

ScenarioOf<3> performed_scenario(const Performer& performer, const SignalSet& signals, int harmonics) {
  ScenarioOf<3> scenario;
  scenario.scene = performer.scene;
  scenario.length = performer.length;
  scenario.size = performer.size;
  scenario.self_contact_reason = performer.self_contact_reason;
  MotionCurve(performer.prepared.target).at(0, scenario.start.x, scenario.start.v);
  SignalSet kept = signals;
  if (harmonics > 0 && harmonics < kept.activation.harmonics()) {
    kept.activation = signal::truncated(kept.activation, harmonics, SignalOptions().roll_off);
  }
  const auto player = std::make_shared<signal::Synthesiser>(activations(kept));
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

}  // namespace hydrostat::retarget

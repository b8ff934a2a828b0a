#include "retarget/accuracy.h"

#include <algorithm>
#include <cmath>

#include "retarget/body_material.h"
#include "retarget/step_cost.h"

namespace hydrostat::retarget {
namespace {

using physics::ContactPointsOf;
using physics::PointsOf;
using physics::StateOf;
using physics::VectorOf;

constexpr double kShortestStep = 2e-5;       // [s] of the explicit method as a reference; below, the implicit one is
constexpr double kImplicitStep = 1.0 / 960;  // [s] of the implicit method as a reference, at most
constexpr double kAgreement = 2;             // of what two methods leave open [-]: a larger distance is a disagreement
constexpr int kMostPasses = 4000;            // of the explicit method in a frame: what wants more is not tried
constexpr int kLeastFrames = 2;
// What an estimate may cost beside a run that asked for no bound.
constexpr double kEstimatedSeconds = 1;  // of the motion, with contact; without, what tells what the whole run would cost
constexpr int kEstimatedWindows = 4;
constexpr double kEstimateRuns = 4;     // counted work of an estimate over that of the run it is about [-], at most; but less than
constexpr double kEstimateWork = 5000;  // [ms] is never too much

/// The scenario as it is at another time than 0.
template <int Dim>
ScenarioOf<Dim> from_time(const ScenarioOf<Dim>& scenario, const WindowOf<Dim>& window) {
  ScenarioOf<Dim> later = scenario;
  later.start = window.start;
  hold_at(scenario.clamps, window.begin_s, later.scene.body.held);
  return later;
}

template <int Dim>
SimulationOptions options_for(const WindowOf<Dim>& window, const StepSetting& setting, double frame_s) {
  SimulationOptions options;
  options.method = setting.method;
  options.dt_s = setting.dt_s;
  options.begin_s = window.begin_s;
  options.duration_s = window.duration_s;
  options.frame_rate_hz = 1 / frame_s;
  options.figures = false;
  return options;
}

/// What a setting makes of all windows.
template <int Dim>
struct Repeated {
  std::vector<PointsOf<Dim>> places;
  double busy_s = 0, seconds = 0, steps = 0;
  physics::StepWork work;
  SimulationReport worst;
  bool is_whole = true;
};

template <int Dim>
Repeated<Dim> repeat(const ScenarioOf<Dim>& scenario, const std::vector<WindowOf<Dim>>& windows, const StepSetting& setting,
                     double frame_s, const ContactPointsOf<Dim>& skin, bool has_figures) {
  Repeated<Dim> repeated;
  for (const WindowOf<Dim>& window : windows) {
    SimulationOptions options = options_for(window, setting, frame_s);
    options.figures = has_figures;
    const Simulation run = simulate(from_time(scenario, window), options);
    repeated.is_whole = repeated.is_whole && !run.report.diverged;
    repeated.busy_s += 1e-3 * run.report.ms_per_sim_s * run.report.duration_s;
    repeated.seconds += run.report.duration_s;
    repeated.steps += std::round(run.report.duration_s / setting.dt_s);
    repeated.work = repeated.work + run.work;
    SimulationReport& worst = repeated.worst;
    worst.volume_error_max = std::max(worst.volume_error_max, run.report.volume_error_max);
    worst.momentum_residual_mg = std::max(worst.momentum_residual_mg, run.report.momentum_residual_mg);
    worst.angular_residual_mgl = std::max(worst.angular_residual_mgl, run.report.angular_residual_mgl);
    const auto frames = static_cast<Eigen::Index>(std::lround(window.duration_s / frame_s));
    for (Eigen::Index f = 1; f <= frames; ++f) {
      PointsOf<Dim> places(Dim, skin.count());
      const PointsOf<Dim> nodes = run.motion.at(std::min(f, run.motion.count() - 1)).template topRows<Dim>();
      for (int p = 0; p < skin.count(); ++p) places.col(p) = skin.of(nodes, p);
      repeated.places.push_back(std::move(places));
    }
  }
  return repeated;
}

template <int Dim>
bool is_active(const ScenarioOf<Dim>& scenario) {
  return scenario.drive || !scenario.waves.empty();
}

/// Counted.
template <int Dim>
double work_ms(const ScenarioOf<Dim>& scenario, const StepSetting& setting, const Repeated<Dim>& repeated) {
  return counted_ms(scenario.scene, setting.method, is_active(scenario), repeated.steps, repeated.work);
}

/// [m] RMS over points and frames.
template <int Dim>
double distance(const std::vector<PointsOf<Dim>>& a, const std::vector<PointsOf<Dim>>& b) {
  double sum = 0, count = 0;
  for (std::size_t f = 0; f < a.size(); ++f) {
    sum += (a[f] - b[f]).squaredNorm();
    count += static_cast<double>(a[f].cols());
  }
  return std::sqrt(sum / count);
}

/// A body that can split over the whole span, which it may spend in parts.
struct Whole {
  Breaking breaking;
  double work_ms = 0, ms_per_sim_s = 0;  // as AccuracyRow's
};

template <int Dim>
Whole whole_run(const ScenarioOf<Dim>& scenario, const AccuracyOptions& options, const StepSetting& setting) {
  const WindowOf<Dim> all{0, options.duration_s, scenario.start};
  const Simulation run = simulate(scenario, options_for(all, setting, options.frame_s));
  Whole whole;
  whole.breaking.pieces = run.report.pieces_end;
  for (const BreakReport& one : run.report.fractures) {
    std::vector<int>& faces = whole.breaking.faces;
    faces.resize(std::max(faces.size(), static_cast<std::size_t>(one.seam) + 1), 0);
    faces[static_cast<std::size_t>(one.seam)] += one.faces;
    whole.breaking.last_s = one.time_s;
  }
  if (whole.breaking.is_broken()) whole.breaking.first_s = run.report.fractures.front().time_s;
  const double seconds = std::max(setting.dt_s, run.report.duration_s);
  whole.work_ms = counted_ms(scenario.scene, setting.method, is_active(scenario), std::round(seconds / setting.dt_s), run.work) / seconds;
  whole.ms_per_sim_s = run.report.ms_per_sim_s;
  return whole;
}

/// The step of the wished length or less of which whole ones fill a frame.
double whole_part(double frame_s, double wished_s) { return frame_s / std::ceil(frame_s / wished_s - 1e-9); }

template <int Dim>
double own_step(const physics::SceneOf<Dim>& scene, double frame_s) {
  return physics::make_explicit_stepper<Dim>(scene)->substep(frame_s);
}

/// Whether self-contact changed a motion.
template <int Dim>
bool touches_itself(ScenarioOf<Dim> scenario, const SimulationOptions& path, const Simulation& run) {
  if (!scenario.scene.self_contact.is_on) return false;
  scenario.scene.self_contact.is_on = false;
  return simulate(scenario, path).motion.frames != run.motion.frames;
}

/// Windows along the motion by a setting.
template <int Dim>
std::vector<WindowOf<Dim>> windows_along(const ScenarioOf<Dim>& scenario, const AccuracyOptions& options,
                                         const StepSetting& setting) {
  const auto whole = std::max(1.0, std::round(options.duration_s / options.frame_s));
  WindowOf<Dim> all{0, whole * options.frame_s, scenario.start};
  if (scenario.fracture) {
    // A body's parts go where the step at which it broke sends them: what is compared ends before that.
    const std::vector<BreakReport> breaks = simulate(scenario, options_for(all, setting, options.frame_s)).report.fractures;
    const double until = breaks.empty() ? all.duration_s : breaks.front().time_s - setting.dt_s;
    all.duration_s = std::max(1.0, std::floor(until / options.frame_s + 1e-9)) * options.frame_s;
  }
  const bool may_touch = scenario.scene.has_ground || !scenario.scene.obstacles.empty();
  if (!may_touch && !scenario.scene.self_contact.is_on) return {all};
  SimulationOptions path = options_for(all, setting, options.frame_s);
  path.velocities = true;
  const Simulation run = simulate(scenario, path);
  if (run.course.contact_weights.maxCoeff() == 0 && !touches_itself(scenario, path, run)) return {all};
  const auto frames = std::max(static_cast<double>(kLeastFrames), std::round(options.window_s / options.frame_s));
  const double last = std::max(0.0, static_cast<double>(run.motion.count() - 1) - frames);
  std::vector<WindowOf<Dim>> windows;
  for (int k = 0; k < options.windows; ++k) {
    const auto f = static_cast<Eigen::Index>(std::floor(last * k / std::max(1, options.windows - 1)));
    WindowOf<Dim> window{static_cast<double>(f) * options.frame_s, std::min(frames * options.frame_s, all.duration_s),
                         scenario.start};
    if (!windows.empty() && window.begin_s <= windows.back().begin_s) continue;
    const Eigen::Index nodes = scenario.start.x.cols();  // before copies of them, where the body can split
    window.start.x = run.motion.at(f).template topRows<Dim>().leftCols(nodes);
    window.start.v = run.velocities[static_cast<std::size_t>(f)].template topRows<Dim>().leftCols(nodes);
    window.start.obstacle_travel.resize(Dim, static_cast<Eigen::Index>(run.obstacle_travels.size()));
    for (std::size_t o = 0; o < run.obstacle_travels.size(); ++o) {
      window.start.obstacle_travel.col(static_cast<Eigen::Index>(o)) =
          run.obstacle_travels[o].frames.col(f).template head<Dim>();
    }
    windows.push_back(std::move(window));
  }
  return windows;
}

/// Places of the rest shape in the tets of a body: each in the one of which it lies least far outside.
template <int Dim>
ContactPointsOf<Dim> carried(const physics::BodyOf<Dim>& body, const PointsOf<Dim>& places) {
  ContactPointsOf<Dim> points;
  points.nodes.resize(Dim + 1, places.cols());
  points.weights.resize(Dim + 1, places.cols());
  Eigen::VectorXd best = Eigen::VectorXd::Constant(places.cols(), -1e300);
  for (int t = 0; t < body.tet_count(); ++t) {
    Eigen::Matrix<double, Dim, Dim> spans;
    for (int k = 0; k < Dim; ++k) spans.col(k) = body.rest.col(body.tets(k + 1, t)) - body.rest.col(body.tets(0, t));
    const Eigen::Matrix<double, Dim, Dim> inverse = spans.inverse();
    for (Eigen::Index p = 0; p < places.cols(); ++p) {
      Eigen::Matrix<double, Dim + 1, 1> weights;
      weights.template tail<Dim>() = inverse * (places.col(p) - body.rest.col(body.tets(0, t)));
      weights[0] = 1 - weights.template tail<Dim>().sum();
      if (!(weights.minCoeff() > best[p])) continue;
      best[p] = weights.minCoeff();
      points.nodes.col(p) = body.tets.col(t);
      points.weights.col(p) = weights;
    }
  }
  return points;
}

template <int Dim>
bool is_same_mesh(const physics::BodyOf<Dim>& a, const physics::BodyOf<Dim>& b) {
  return a.node_count() == b.node_count() && a.rest == b.rest && a.tet_count() == b.tet_count() && a.tets == b.tets;
}

/// The windows of the reference for a body in another mesh.
template <int Dim>
std::vector<WindowOf<Dim>> carried_windows(const ReferenceOf<Dim>& reference, const physics::BodyOf<Dim>& body) {
  const ContactPointsOf<Dim> nodes = carried<Dim>(reference.scenario.scene.body, body.rest);
  std::vector<WindowOf<Dim>> windows = reference.windows;
  for (WindowOf<Dim>& window : windows) {
    StateOf<Dim> start{PointsOf<Dim>(Dim, body.node_count()), PointsOf<Dim>(Dim, body.node_count()),
                       window.start.obstacle_travel};
    for (int i = 0; i < body.node_count(); ++i) {
      start.x.col(i) = nodes.of(window.start.x, i);
      start.v.col(i) = nodes.of(window.start.v, i);
    }
    window.start = std::move(start);
  }
  return windows;
}

template <int Dim>
PointsOf<Dim> rest_places(const physics::BodyOf<Dim>& body, const ContactPointsOf<Dim>& skin) {
  PointsOf<Dim> places(Dim, skin.count());
  for (int p = 0; p < skin.count(); ++p) places.col(p) = skin.of(body.rest, p);
  return places;
}

template <int Dim>
std::string element_of(const physics::BodyOf<Dim>& body) {
  const bool is_box = !body.elements.empty() && body.elements.front().block.is_box();
  if (Dim == 3) return is_box ? "hex" : "tet";
  return is_box ? "quad" : "triangle";
}

}  // namespace

bool break_alike(const Breaking& a, const Breaking& b, double within_s) {
  return a.pieces == b.pieces && a.faces == b.faces && std::abs(a.first_s - b.first_s) <= within_s &&
         std::abs(a.last_s - b.last_s) <= within_s;
}

template <int Dim>
double ReferenceOf<Dim>::uncertainty_m() const {
  return check_distance_m <= kAgreement * (own_error_m + check_error_m) ? own_error_m : check_distance_m;
}

template <int Dim>
ReferenceOf<Dim> make_reference(const ScenarioOf<Dim>& scenario, const AccuracyOptions& options, bool is_checked) {
  const double own = own_step(scenario.scene, options.frame_s);
  StepSetting path{physics::Method::kExplicit, whole_part(options.frame_s, own)};
  if (own / options.fineness < kShortestStep)
    path = {physics::Method::kImplicit, whole_part(options.frame_s, kImplicitStep)};
  return make_reference(scenario, options, windows_along(scenario, options, path), scenario.scene.contact_points,
                        is_checked);
}

template <int Dim>
ReferenceOf<Dim> make_reference(const ScenarioOf<Dim>& scenario, const AccuracyOptions& options,
                                std::vector<WindowOf<Dim>> windows, ContactPointsOf<Dim> skin, bool is_checked) {
  ReferenceOf<Dim> reference{scenario, options, std::move(windows), std::move(skin), {}, {}, 0, {}, 0, 0, 0, {}, false};
  const double own = own_step(scenario.scene, options.frame_s);
  const StepSetting by_explicit{physics::Method::kExplicit, whole_part(options.frame_s, own / options.fineness)};
  const StepSetting by_implicit{physics::Method::kImplicit, whole_part(options.frame_s, kImplicitStep)};
  const bool is_stiff = by_explicit.dt_s < kShortestStep;
  reference.setting = is_stiff ? by_implicit : by_explicit;
  const auto run = [&](const StepSetting& setting) {
    Repeated<Dim> made = repeat(scenario, reference.windows, setting, options.frame_s, reference.skin, false);
    reference.work_ms += work_ms(scenario, setting, made);
    return made;
  };
  const auto twice = [&](const StepSetting& setting) {
    return StepSetting{setting.method, whole_part(options.frame_s, 2 * setting.dt_s)};
  };
  reference.places = run(reference.setting).places;
  reference.own_error_m = distance<Dim>(reference.places, run(twice(reference.setting)).places);
  if (scenario.fracture) {
    reference.breaking = whole_run(scenario, options, reference.setting).breaking;
    const Breaking rougher = whole_run(scenario, options, twice(reference.setting)).breaking;
    reference.is_breaking_settled = break_alike(reference.breaking, rougher, options.frame_s);
  }
  if (!is_checked) return reference;
  reference.check = is_stiff ? StepSetting{physics::Method::kExplicit, whole_part(options.frame_s, own)} : by_implicit;
  const auto check = run(reference.check).places;
  reference.check_distance_m = distance<Dim>(reference.places, check);
  if (!is_stiff) reference.check_error_m = distance<Dim>(check, run(twice(reference.check)).places);
  return reference;
}

template <int Dim>
AccuracyRow measure_error(const ReferenceOf<Dim>& reference, const ScenarioOf<Dim>& scenario, const StepSetting& setting) {
  const physics::BodyOf<Dim>& body = scenario.scene.body;
  const bool is_same = is_same_mesh(reference.scenario.scene.body, body);
  const ContactPointsOf<Dim> skin =
      is_same ? reference.skin : carried<Dim>(body, rest_places(reference.scenario.scene.body, reference.skin));
  return measure_error(reference, scenario, setting, is_same ? reference.windows : carried_windows(reference, body), skin);
}

template <int Dim>
AccuracyRow measure_error(const ReferenceOf<Dim>& reference, const ScenarioOf<Dim>& scenario, const StepSetting& setting,
                          const std::vector<WindowOf<Dim>>& windows, const ContactPointsOf<Dim>& skin) {
  const physics::BodyOf<Dim>& body = scenario.scene.body;
  const Repeated<Dim> repeated = repeat(scenario, windows, setting, reference.options.frame_s, skin, true);
  AccuracyRow row;
  row.method = physics::name_of(setting.method);
  row.element = element_of(body);
  row.material = name_of(body.elements.empty() ? BodyMaterial::kSprings : material_of(body.elements.front().block.law));
  row.nodes = body.node_count();
  row.dt_s = setting.dt_s;
  row.iterations = repeated.work.rounds / std::max(1.0, repeated.steps);
  row.error_rms_m = distance<Dim>(reference.places, repeated.places);
  row.error_rel_length = row.error_rms_m / reference.scenario.length;
  if (repeated.seconds > 0) row.ms_per_sim_s = 1000 * repeated.busy_s / repeated.seconds;
  if (repeated.seconds > 0) {
    row.work_ms = work_ms(scenario, setting, repeated) / repeated.seconds;
  }
  row.volume_error = repeated.worst.volume_error_max;
  row.momentum_error = repeated.worst.momentum_residual_mg;
  row.angular_error = repeated.worst.angular_residual_mgl;
  row.stable = repeated.is_whole && row.error_rel_length < 1;
  if (scenario.fracture && row.stable) {
    const Whole whole = whole_run(scenario, reference.options, setting);
    row.breaking = whole.breaking;
    row.work_ms = whole.work_ms;
    row.ms_per_sim_s = whole.ms_per_sim_s;
    row.is_refused = reference.is_breaking_settled && !break_alike(row.breaking, reference.breaking, reference.options.frame_s);
  }
  if (!repeated.is_whole) row.ms_per_sim_s = row.volume_error = row.momentum_error = row.angular_error = std::nan("");
  return row;
}

template <int Dim>
std::vector<std::vector<StepSetting>> settings_to_try(const physics::SceneOf<Dim>& scene, double frame_s) {
  const double own = own_step(scene, frame_s);
  std::vector<std::vector<StepSetting>> all;
  const auto add = [&](physics::Method method, std::initializer_list<double> steps) {
    std::vector<StepSetting> settings;
    for (const double step : steps) {
      const double dt_s = whole_part(frame_s, step);
      if (settings.empty() || dt_s < settings.back().dt_s) settings.push_back({method, dt_s});
    }
    all.push_back(std::move(settings));
  };
  // What takes substeps of its own gains by shorter steps only below these: an outer step of a frame holds activations long.
  add(physics::Method::kSpring, {1.0 / 60, 1.0 / 240});
  if (frame_s / own < kMostPasses) add(physics::Method::kExplicit, {1.0 / 60, 1.0 / 120, 1.0 / 240, 0.6 * own, 0.3 * own});
  add(physics::Method::kXpbd, {1.0 / 60, 1.0 / 240, 1.0 / 5000});
  add(physics::Method::kImplicit, {1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 480, 1.0 / 960});
  add(physics::Method::kEuler, {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 480});
  return all;
}

namespace {

/// How far a setting and what is held against it part over a stretch of the motion.
struct Parted {
  double distance_m = 0, span_s = 0;
  double coarse_ms = 0, fine_ms = 0;  // counted, of a simulated second
};

template <int Dim>
Parted parted(const ScenarioOf<Dim>& scenario, const AccuracyOptions& options, const StepSetting& coarse, const StepSetting& fine) {
  const std::vector<WindowOf<Dim>> windows = windows_along(scenario, options, coarse);
  const ContactPointsOf<Dim>& skin = scenario.scene.contact_points;
  const Repeated<Dim> a = repeat(scenario, windows, coarse, options.frame_s, skin, false);
  const Repeated<Dim> b = repeat(scenario, windows, fine, options.frame_s, skin, false);
  const double seconds = static_cast<double>(windows.size()) * windows.front().duration_s;
  return {distance<Dim>(a.places, b.places), windows.front().duration_s, work_ms(scenario, coarse, a) / seconds, work_ms(scenario, fine, b) / seconds};
}

}  // namespace

template <int Dim>
EstimatedError estimated_error(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  AccuracyOptions accuracy;
  accuracy.frame_s = options.dt_s * std::max(1.0, std::round(accuracy.frame_s / options.dt_s));
  accuracy.duration_s = std::min(options.duration_s, kEstimatedSeconds);
  accuracy.windows = kEstimatedWindows;
  const StepSetting setting{options.method, options.dt_s};
  const double substep = physics::make_stepper(options.method, scenario.scene)->substep(options.dt_s);
  StepSetting finer{options.method, options.dt_s / (2 * std::max(1.0, std::round(options.dt_s / substep)))};
  const bool is_accurate = options.method == physics::Method::kExplicit || options.method == physics::Method::kImplicit;
  const bool is_stiff = options.method == physics::Method::kExplicit && substep < options.dt_s && finer.dt_s < kShortestStep;
  if (!is_accurate) finer = {physics::Method::kExplicit, own_step(scenario.scene, options.dt_s)};
  if (is_stiff || (!is_accurate && finer.dt_s < kShortestStep)) {
    finer = {physics::Method::kImplicit, whole_part(options.dt_s, kImplicitStep)};
  }
  Parted found = parted(scenario, accuracy, setting, finer);
  const bool is_free = found.span_s > accuracy.duration_s - accuracy.frame_s;  // neither contact nor a break ended it
  const double affordable = std::max(kEstimateWork, kEstimateRuns * found.coarse_ms * options.duration_s);
  accuracy.duration_s = std::min(options.duration_s, affordable / (found.coarse_ms + found.fine_ms));
  if (is_free && accuracy.duration_s > kEstimatedSeconds) found = parted(scenario, accuracy, setting, finer);
  EstimatedError estimate{(finer.method == options.method ? 2 : 1) * found.distance_m / scenario.length, found.span_s, finer, {}, {}};
  if (!scenario.fracture) return estimate;
  estimate.breaking = whole_run(scenario, accuracy, setting).breaking;
  estimate.finer_breaking = whole_run(scenario, accuracy, finer).breaking;
  return estimate;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                          \
  template struct ReferenceOf<Dim>;                                                                                         \
  template ReferenceOf<Dim> make_reference<Dim>(const ScenarioOf<Dim>&, const AccuracyOptions&, bool);                      \
  template ReferenceOf<Dim> make_reference<Dim>(const ScenarioOf<Dim>&, const AccuracyOptions&, std::vector<WindowOf<Dim>>, \
                                                ContactPointsOf<Dim>, bool);                                                \
  template AccuracyRow measure_error<Dim>(const ReferenceOf<Dim>&, const ScenarioOf<Dim>&, const StepSetting&);             \
  template AccuracyRow measure_error<Dim>(const ReferenceOf<Dim>&, const ScenarioOf<Dim>&, const StepSetting&,              \
                                          const std::vector<WindowOf<Dim>>&, const ContactPointsOf<Dim>&);                  \
  template std::vector<std::vector<StepSetting>> settings_to_try<Dim>(const physics::SceneOf<Dim>&, double);                \
  template EstimatedError estimated_error<Dim>(const ScenarioOf<Dim>&, const SimulationOptions&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::retarget

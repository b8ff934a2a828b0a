#include "retarget/simulation.h"

#include <algorithm>
#include <cmath>

#include "physics/effect.h"
#include "physics/internal_forces.h"
#include "physics/self_contact.h"
#include "physics/tearing.h"
#include "retarget/cpu_seconds.h"
#include "retarget/divergence.h"
#include "retarget/gravity.h"
#include "retarget/obstacle_moves.h"
#include "retarget/simulation_record.h"

namespace hydrostat::retarget {
namespace {

using physics::PointsOf;
using physics::SpinOf;
using physics::VectorOf;

template <int Dim>
Eigen::Vector3d in_space(const VectorOf<Dim>& place) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  point.head<Dim>() = place;
  return point;
}

/// The deepest that a contact point lies in ground or obstacles [m].
template <int Dim>
double penetration(const physics::SceneOf<Dim>& scene, const physics::StateOf<Dim>& state) {
  double deepest = 0;
  VectorOf<Dim> normal;
  for (int p = 0; p < scene.contact_points.count(); ++p) {
    const VectorOf<Dim> point = scene.contact_points.of(state.x, p);
    if (scene.has_ground) deepest = std::max(deepest, scene.ground.offset - scene.ground.normal.dot(point));
    for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
      VectorOf<Dim> travel = VectorOf<Dim>::Zero();
      if (state.obstacle_travel.cols() > 0) travel = state.obstacle_travel.col(static_cast<Eigen::Index>(o));
      if (physics::distance_at_least<Dim>(scene.obstacles[o], travel, point) > 0) continue;
      deepest = std::max(deepest, -physics::signed_distance<Dim>(scene.obstacles[o], travel, point, normal));
    }
  }
  return deepest;
}

/// One free simulation, step by step.
template <int Dim>
class Course {
 public:
  Course(const ScenarioOf<Dim>& scenario, const SimulationOptions& options);
  Simulation play();

 private:
  struct Energy {
    double kinetic, elastic, gravity;
    double sum() const { return kinetic + elastic + gravity; }
  };
  Energy energy() const;
  double now() const { return options_.begin_s + static_cast<double>(done_) * options_.dt_s; }
  bool is_split() const { return activation_split_.size() > 0; }
  const Eigen::VectorXd& activation_now() const { return is_split() ? activation_split_ : activation_; }
  void drive(double time_s);
  void let_go();
  void tear();
  void go_on_anew();
  physics::Termination step();
  SpinOf<Dim> hold_moment() const;
  void measure();
  void write_frame();
  void tell_divergence();
  Simulation finish();

  const ScenarioOf<Dim>& scenario_;
  const SimulationOptions& options_;
  physics::SceneOf<Dim> scene_;  // a copy, whose obstacles change their velocities
  const physics::BodyOf<Dim>& body_;
  std::optional<physics::Tearing<Dim>> tearing_;  // where the body can split
  SimulationRecord<Dim> record_;
  std::unique_ptr<physics::StepperOf<Dim>> stepper_;
  std::vector<std::unique_ptr<physics::EffectOf<Dim>>> effects_;
  std::optional<physics::InternalForces<Dim>> forces_;
  std::optional<physics::SelfContactSet<Dim>> itself_;
  const long steps_, steps_per_frame_;
  const double mass_, weight_, rest_volume_;
  const VectorOf<Dim> centre_at_start_;
  const double energy_of_origin_;  // [J] of the whole mass in the local origin, in the field of gravity

  long done_ = 0;
  long guard_steps_ = 0;    // of steppers before this one
  double next_release_s_ = 1e300;
  double busy_s_ = 0, work_ = 0, energy_at_start_ = 0;
  physics::StateOf<Dim> state_, before_;
  Eigen::VectorXd activation_;        // of the whole body
  Eigen::VectorXd activation_split_;  // of the body as it is now, once it has split
  physics::ImpulsesOf<Dim> impulses_;
  PointsOf<Dim> effect_;
  Simulation result_;
};

template <int Dim>
std::optional<physics::Tearing<Dim>> plan_tearing(const ScenarioOf<Dim>& scenario, physics::Method method) {
  if (!scenario.fracture) return std::nullopt;
  return std::optional<physics::Tearing<Dim>>(std::in_place, *scenario.fracture, scenario.scene.body, method == physics::Method::kSpring);
}

template <int Dim>
Course<Dim>::Course(const ScenarioOf<Dim>& scenario, const SimulationOptions& options)
    : scenario_(scenario),
      options_(options),
      scene_(scenario.scene),
      body_(scene_.body),
      tearing_(plan_tearing(scenario, options.method)),
      record_(scenario, options, tearing_ ? tearing_->apart() : body_),
      stepper_(physics::make_stepper(options.method, scene_)),
      effects_(physics::plan_effects(scene_)),
      steps_(std::max(1L, std::lround(options.duration_s / options.dt_s))),
      steps_per_frame_(std::max(1L, std::lround(1 / (options.frame_rate_hz * options.dt_s)))),
      mass_(body_.mass.sum()),
      weight_(kGravity * mass_),
      rest_volume_(body_.rest_volume.sum()),
      centre_at_start_(physics::centre_of_mass(body_, scenario.start.x)),
      energy_of_origin_(-mass_ * scene_.gravity.dot(scenario.origin)),
      state_(scenario.start),
      before_(state_),
      activation_(body_.edge_count()),
      impulses_(physics::make_impulses(scene_)),
      effect_(Dim, body_.node_count()) {
  if (state_.obstacle_travel.cols() == 0) state_.obstacle_travel.setZero(Dim, static_cast<Eigen::Index>(scene_.obstacles.size()));
  forces_.emplace(body_);
  itself_.emplace(scene_);
  if (tearing_) record_.follow({tearing_->node_now(), tearing_->mass_share(), tearing_->apart_edges()});
  drive(options.begin_s + 0.5 * options.dt_s);
  forces_->set_activation(activation_);
  for (const Clamp& clamp : scenario.clamps) {
    if (clamp.until_s > options.begin_s) next_release_s_ = std::min(next_release_s_, clamp.until_s);
  }
  energy_at_start_ = energy().sum();
  SimulationReport& report = result_.report;
  report.dimension = Dim;
  report.energy_start_mgl = (energy_at_start_ + energy_of_origin_) / (weight_ * scenario.length);
  if (options.trace) record_.begin_trace(state_, activation_);
  write_frame();
}

template <int Dim>
typename Course<Dim>::Energy Course<Dim>::energy() const {
  return {0.5 * state_.v.colwise().squaredNorm().dot(body_.mass), forces_->elastic_energy(state_.x),
          -scene_.gravity.dot(state_.x * body_.mass)};
}

/// From here on another scene is stepped, in which fewer nodes are held.
template <int Dim>
void Course<Dim>::let_go() {
  hold_at(scenario_.clamps, now(), scene_.body.held);
  if (tearing_) scene_.body.held = physics::copies_of(scene_.body.held, tearing_->origin_now());
  next_release_s_ = 1e300;
  for (const Clamp& clamp : scenario_.clamps) {
    if (clamp.until_s > now()) next_release_s_ = std::min(next_release_s_, clamp.until_s);
  }
  go_on_anew();
}

template <int Dim>
void Course<Dim>::go_on_anew() {
  guard_steps_ += stepper_->guard_steps();
  result_.work = result_.work + stepper_->work();
  stepper_ = physics::make_stepper(options_.method, scene_);
  impulses_ = physics::make_impulses(scene_);
}

/// Breaks what bears too much; the same method goes on with the body that is left.
template <int Dim>
void Course<Dim>::tear() {
  const double began = thread_seconds();
  const std::vector<int> broken = tearing_->break_loaded(state_, activation_);
  if (!broken.empty() && tearing_->split(scene_, state_)) {
    go_on_anew();
    before_ = state_;
    activation_split_ = activation_(tearing_->edges_now());
    effects_ = physics::plan_effects(scene_);
    effect_.resize(Dim, body_.node_count());
    forces_.emplace(body_);
    forces_->set_activation(activation_split_);
    itself_.emplace(scene_);
    record_.follow({tearing_->node_now(), tearing_->mass_share(), tearing_->apart_edges()});
    result_.report.pieces_end = tearing_->part_count();
  }
  busy_s_ += thread_seconds() - began;
  for (std::size_t s = 0; s < broken.size(); ++s) {
    if (broken[s] == 0) continue;
    const double time_s = static_cast<double>(done_) * options_.dt_s;
    result_.report.fractures.push_back({time_s, static_cast<int>(s), broken[s], result_.report.pieces_end});
  }
}

template <int Dim>
void Course<Dim>::drive(double time_s) {
  if (scenario_.drive) {
    scenario_.drive(time_s, activation_);
  } else {
    activations_at(scenario_.waves, time_s, activation_);
  }
}

template <int Dim>
physics::Termination Course<Dim>::step() {
  const double dt = options_.dt_s, begin = now();
  before_ = state_;
  if (scenario_.drive || !scenario_.waves.empty()) {
    drive(begin + 0.5 * dt);
    if (is_split()) activation_split_ = activation_(tearing_->edges_now());
    work_ -= forces_->elastic_energy(state_.x);
    forces_->set_activation(activation_now());
    work_ += forces_->elastic_energy(state_.x);
  }
  move_obstacles(scenario_.moves, begin, dt, scene_.obstacles);
  if (begin >= next_release_s_) let_go();
  const VectorOf<Dim> pushed = pushed_velocity(scenario_.pushes, begin, begin + dt);
  const bool has_effect = !effects_.empty() || !pushed.isZero(0);
  if (has_effect) effect_ = (pushed / dt) * body_.mass.transpose();
  const double began = thread_seconds();
  for (const auto& effect : effects_) effect->add_forces(dt, state_, effect_);
  const physics::Termination termination = stepper_->step(dt, activation_now(), has_effect ? &effect_ : nullptr, state_, impulses_);
  busy_s_ += thread_seconds() - began;
  if (termination == physics::Termination::kDiverged) return termination;
  ++done_;
  work_ += impulses_.obstacle_work;
  if (has_effect) work_ += effect_.cwiseProduct(state_.x - before_.x).sum();
  return termination;
}

/// Of what holds the held nodes [N m s], about the world's origin.
template <int Dim>
SpinOf<Dim> Course<Dim>::hold_moment() const {
  SpinOf<Dim> moment = SpinOf<Dim>::Zero();
  for (std::size_t n = 0; n < body_.held.size(); ++n) {
    moment += physics::cross<Dim>(state_.x.col(body_.held[n]), impulses_.hold.col(static_cast<Eigen::Index>(n)));
  }
  return moment;
}

template <int Dim>
void Course<Dim>::measure() {
  SimulationReport& report = result_.report;
  const double dt = options_.dt_s;
  const VectorOf<Dim> change = physics::momentum(body_, state_.v) - physics::momentum(body_, before_.v);
  const VectorOf<Dim> booked = impulses_.contact_nodes.rowwise().sum() + impulses_.effect_nodes.rowwise().sum() +
                               impulses_.hold.rowwise().sum() + dt * mass_ * scene_.gravity;
  report.momentum_residual_mg = std::max(report.momentum_residual_mg, (change - booked).norm() / (dt * weight_));
  const VectorOf<Dim> origin = VectorOf<Dim>::Zero();
  const SpinOf<Dim> turn = physics::angular_momentum(body_, state_.x, state_.v, origin) -
                           physics::angular_momentum(body_, before_.x, before_.v, origin) - impulses_.contact_moment -
                           impulses_.effect_moment - hold_moment() - impulses_.gravity_moment;
  report.angular_residual_mgl = std::max(report.angular_residual_mgl, turn.norm() / (dt * weight_ * scenario_.length));
  const double assist = impulses_.correction_nodes.colwise().norm().sum();
  report.external_assist_mg = std::max(report.external_assist_mg, assist / (dt * weight_));
  report.energy_excess_mgl =
      std::max(report.energy_excess_mgl, (energy().sum() - energy_at_start_ - work_) / (weight_ * scenario_.length));
  report.volume_error_end = std::abs(physics::volume(body_, state_.x) / rest_volume_ - 1);
  report.volume_error_max = std::max(report.volume_error_max, report.volume_error_end);
  report.inverted_elements_end = static_cast<int>((physics::jacobians(body_, state_.x).array() <= 0).count());
  report.inverted_elements = std::max(report.inverted_elements, report.inverted_elements_end);
  report.penetration_max_size = std::max(report.penetration_max_size, penetration(scene_, state_) / scenario_.size);
  report.self_penetration_max_size = std::max(report.self_penetration_max_size, itself_->deepest(state_.x) / scenario_.size);
  report.speed_end_m_s = state_.v.colwise().norm().maxCoeff();
  report.speed_max_m_s = std::max(report.speed_max_m_s, report.speed_end_m_s);
  if (options_.trace) {
    record_.add_step(impulses_, body_.held, hold_moment(), activation_);
    if (record_.row_is_full()) record_.write_row(static_cast<double>(done_) * options_.dt_s, state_);
  }
}

template <int Dim>
void Course<Dim>::write_frame() {
  const Energy here = energy();
  const double force = impulses_.contact.colwise().norm().sum() / options_.dt_s;
  record_.write_frame(state_, in_space<Dim>(physics::centre_of_mass(body_, state_.x) + scenario_.origin),
                      {static_cast<double>(done_) * options_.dt_s, here.kinetic, here.elastic, here.gravity + energy_of_origin_, work_,
                       physics::volume(body_, state_.x) / rest_volume_, penetration(scene_, state_), force / weight_,
                       activation_.mean()});
}

template <int Dim>
void Course<Dim>::tell_divergence() {
  SimulationReport& report = result_.report;
  report.diverged = true;
  report.diverged_time_s = static_cast<double>(done_) * options_.dt_s;
  report.diverged_cause = divergence_cause(body_, state_, options_.method, options_.dt_s, report.diverged_time_s);
}

template <int Dim>
Simulation Course<Dim>::play() {
  while (done_ < steps_) {
    if (step() == physics::Termination::kDiverged) {
      tell_divergence();
      break;
    }
    if (options_.figures) measure();
    if (tearing_) tear();
    if (done_ % steps_per_frame_ == 0) write_frame();
  }
  return finish();
}

template <int Dim>
Simulation Course<Dim>::finish() {
  SimulationReport& report = result_.report;
  report.duration_s = static_cast<double>(done_) * options_.dt_s;
  report.energy_end_mgl = (energy().sum() + energy_of_origin_) / (weight_ * scenario_.length);
  report.guard_steps = static_cast<int>(guard_steps_ + stepper_->guard_steps());
  result_.work = result_.work + stepper_->work();
  report.work_mgl = work_ / (weight_ * scenario_.length);
  const Eigen::Vector3d up = in_space<Dim>(scene_.has_ground ? scene_.ground.normal : VectorOf<Dim>::UnitY());
  const Eigen::Vector3d way =
      in_space<Dim>(physics::centre_of_mass(body_, state_.x) - centre_at_start_);
  report.travel_length = (way - up * up.dot(way)).norm() / scenario_.length;
  if (report.duration_s > 0) report.ms_per_sim_s = 1000 * busy_s_ / report.duration_s;
  if (busy_s_ > 0) report.real_time_factor = report.duration_s / busy_s_;

  record_.finish(1 / (static_cast<double>(steps_per_frame_) * options_.dt_s), result_);
  return std::move(result_);
}

}  // namespace

std::string broken_rule(const SimulationOptions& options) {
  if (!(options.dt_s > 0) || !std::isfinite(options.dt_s)) return "dt_s is not above 0";
  if (!(options.duration_s > 0) || !std::isfinite(options.duration_s)) return "duration_s is not above 0";
  if (!(options.frame_rate_hz > 0)) return "frame_rate_hz is not above 0";
  if (options.steps_per_row < 1) return "steps_per_row is below 1";
  return {};
}

template <int Dim>
Simulation simulate(const ScenarioOf<Dim>& scenario, const SimulationOptions& options) {
  return Course<Dim>(scenario, options).play();
}

template Simulation simulate<2>(const ScenarioOf<2>&, const SimulationOptions&);
template Simulation simulate<3>(const ScenarioOf<3>&, const SimulationOptions&);

}  // namespace hydrostat::retarget

#include "retarget/replay.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "physics/effect.h"
#include "retarget/contact_loads.h"
#include "retarget/cost_source.h"
#include "retarget/cpu_seconds.h"
#include "retarget/divergence.h"
#include "retarget/fall.h"
#include "retarget/firm_plan.h"
#include "retarget/leap_feedback.h"
#include "retarget/leaps.h"
#include "retarget/model_answers.h"
#include "retarget/obstacle_moves.h"
#include "retarget/path_gain.h"
#include "retarget/planned_contacts.h"
#include "retarget/reference_glide.h"
#include "retarget/replay_metrics.h"
#include "retarget/return_map.h"
#include "retarget/roll_brace.h"
#include "retarget/slip_meter.h"
#include "retarget/slope_lean.h"
#include "retarget/state_estimate.h"
#include "retarget/strength_estimate.h"
#include "retarget/stride_feedback.h"
#include "retarget/uneven_ground.h"

namespace hydrostat::retarget {
namespace {

Eigen::Map<const Eigen::VectorXd> column(const Eigen::Matrix3Xd& points) { return {points.data(), points.size()}; }

/// Where the signals take the body.
NominalPath path_of(const ReplayInput& input) { return input.path ? *input.path : NominalPath(); }

/// The path's first state; what is played once begins at rest.
physics::State first_state(const Motion& target, const MotionCurve& curve, NominalPathCurve& path) {
  physics::State state;
  curve.at(0, state.x, state.v);
  path.apply(0, state);
  if (!target.loop) state.v.setZero();
  return state;
}

/// The corrector's options as the plan and its path want them.
CorrectorOptions gain_for(const ReplayInput& input, const ReplayOptions& options) {
  CorrectorOptions gain = gain_of_firm_plan(input.prepared, gain_of_leaps(input.prepared, gain_on_path(input, options.corrector)));
  gain.regulator.reach = 0;
  return gain;
}

double control_step(const ReplayOptions& options) { return options.step_s * options.steps_per_control; }

/// Of a regulator, that looks ahead by its cost to go, and a control step at a time. What it predicts is compared with what the body did only
/// where that is seen as it is.
CorrectorOptions regulated(CorrectorOptions gain, const ReplayOptions& options) {
  gain.regulator = options.corrector.regulator;
  gain.horizon_s = control_step(options);
  if (!options.observation.is_exact()) gain.regulator.learn = 0;
  return gain;
}

/// None where nothing is to be regulated, or cannot be.
std::shared_ptr<const CostToGo> cost_for(const ReplayInput& input, const ReplayOptions& options) {
  const RegulatorOptions& regulator = options.corrector.regulator;
  if (!options.correct || regulator.reach == 0) return nullptr;
  if (input.costs) {
    assert(input.costs->is_of(input.model, input.muscles, input.prepared, input.path));
    return input.costs->cost(control_step(options), regulator);
  }
  const NominalPath path = path_of(input);
  return CostSource({input.model, input.muscles, input.prepared, path, input.feed_forward, input.length}).cost(control_step(options), regulator);
}

std::optional<physics::Scene> moving_plant(const ReplayInput& input, const ReplayOptions& options) {
  return options.moves.empty() ? std::nullopt : std::optional(input.scene);
}

/// One free simulation, from control step to control step.
class Run {
 public:
  Run(const ReplayInput& input, const ReplayOptions& options) : Run(input, options, cost_for(input, options)) {}
  Replay play();

 private:
  Run(const ReplayInput& input, const ReplayOptions& options, std::shared_ptr<const CostToGo> cost);
  void look_at_body();
  void keep_way();
  void learn_to_steer();
  ReturnMap::Answers ask_model() const;
  WayError go_for_a_cycle(const ReturnMap::Handles& handles);
  const physics::State& estimate();
  void look_at_way(const physics::State& seen, double time_s);
  double way_now(double time_s) const;
  Eigen::Matrix3d heading_now() const;
  void correct(const physics::State& seen);
  void control();
  void take_note(const physics::State& seen);
  void command(double time_s);
  void activate(double share_of_step);
  physics::Termination advance();
  void write_trace(long row);
  void measure(long step);
  void watch_for_fall();
  Replay finish(long rows);

  const ReplayInput& input_;
  const ReplayOptions& options_;
  const Motion& target_;
  const double control_s_;
  const long steps_, steps_per_frame_;
  const Eigen::VectorXd mass_shares_;
  const MotionCurve curve_;
  std::optional<physics::Scene> moving_;  // a copy of the plant, where obstacles change their velocities
  const physics::Scene& plant_;
  NominalPathCurve path_;
  const std::unique_ptr<physics::Stepper> stepper_;
  const std::vector<std::unique_ptr<physics::EffectOf<3>>> effects_;
  const std::shared_ptr<const CostToGo> cost_;
  const double wave_speed_;  // [m/s] sqrt(g L)
  const CorrectorOptions gain_;
  Corrector corrector_;
  std::optional<Corrector> regulator_;  // near the path, where a cost to go is known
  Observer observer_;
  StateEstimate estimate_;
  ReferenceGlide glide_;
  const PlannedContacts planned_;
  std::optional<UnevenGround> uneven_;  // where there is more than the plan's ground
  std::optional<StrengthEstimate> strength_;  // where the plan leaps again and again and the body is seen as it is
  StrideFeedback stride_;
  ReturnMap return_map_;
  LeapFeedback leap_;
  SlopeLean lean_;
  std::optional<RollBrace> brace_;  // where the body is seen as it is: it goes by how fast that rolls
  long cycles_ = 0;  // of a loop, whose ends were seen

  double time_s_ = 0, busy_s_ = 0;
  Eigen::VectorXd correction_;                  // of the muscles
  physics::State state_, reference_, glided_;
  physics::State path_then_;                    // when what is seen was
  physics::State commanded_, before_;           // the path at the time of a command; before_: the last solver step of a control step
  RigidFit fit_;                                // from reference_ to state_
  Eigen::VectorXd activation_;                  // E, of a solver step
  Eigen::VectorXd signals_;                     // E, of the time of activation_
  Eigen::VectorXd mean_activation_;             // E, of a control step
  Eigen::VectorXd mean_feedback_;               // E, of that all that is not the signals
  Eigen::VectorXd feedback_;                    // E, what the corrector adds in this control step
  ContactNow contact_;
  physics::Impulses impulses_, step_impulses_;  // of a solver step, of a control step
  Eigen::Matrix3Xd effect_;                     // [N]
  const ContactThresholds thresholds_;
  ReplayMetrics metrics_;
  SlipMeter slip_;
  FallWatch fall_watch_;
  std::optional<Fall> falling_, fall_;
  std::vector<Eigen::VectorXd> frames_;  // of the motion
  Replay result_;
};

Run::Run(const ReplayInput& input, const ReplayOptions& options, std::shared_ptr<const CostToGo> cost)
    : input_(input),
      options_(options),
      target_(input.prepared.target),
      control_s_(control_step(options)),
      steps_(std::lround(options.duration_s / control_s_)),
      steps_per_frame_(std::max(1L, std::lround(1 / (target_.rate_hz * control_s_)))),
      mass_shares_(input.scene.body.mass / input.scene.body.mass.sum()),
      curve_(target_),
      moving_(moving_plant(input, options)),
      plant_(moving_ ? *moving_ : input.scene),
      path_(path_of(input)),
      stepper_(physics::make_stepper(options.method, plant_)),
      effects_(physics::plan_effects(plant_)),
      cost_(std::move(cost)),
      wave_speed_(std::sqrt(gravity_unit(input.model) * input.length)),
      gain_(gain_for(input, options)),
      corrector_(input.model, input.muscles, input.length, input.limit, gain_),
      observer_(options.observation, control_s_),
      estimate_(options.observation, control_s_, input.scene.gravity.norm()),
      glide_(glide_for(input.prepared, gain_.settle_s, input.length)),
      planned_(input.prepared),
      stride_(input.prepared, input.length, input.scene.body.edges, input.feed_forward),
      return_map_(input.prepared, input.length, input.scene.body),
      leap_(input.prepared, input.length),
      lean_(input.prepared, input.model),
      correction_(Eigen::VectorXd::Zero(input.muscles.fields.cols())),
      state_(first_state(target_, curve_, path_)),
      activation_(input.scene.body.edge_count()),
      mean_activation_(activation_.size()),
      mean_feedback_(activation_.size()),
      feedback_(Eigen::VectorXd::Zero(activation_.size())),
      contact_(planned_.first()),
      impulses_(physics::make_impulses(input.scene)),
      step_impulses_(impulses_),
      effect_(3, input.scene.body.node_count()),
      thresholds_(contact_thresholds(input.scene, input.length, control_s_)),
      metrics_(input, control_s_, steps_, state_),
      slip_(input.scene, input.prepared, input.length, options.step_s),
      frames_{column(state_.x)} {
  state_.obstacle_travel.setZero(3, static_cast<Eigen::Index>(plant_.obstacles.size()));
  if (!plant_.obstacles.empty()) uneven_.emplace(plant_, input.prepared, input.length, options.corrector.clearance);
  curve_.at(0, reference_.x, reference_.v);
  fit_ = best_rigid_fit(reference_.x, state_.x, mass_shares_);
  if (options.correct && lean_.is_needed()) lean_.apply(lean_.at(0), input.scene.body.edges, state_);  // it is let go as it is to stand
  const bool is_seen = options.correct && options.observation.is_exact();
  if (is_seen && target_.loop && has_flight(input.prepared)) strength_.emplace(input.model, control_s_);
  if (is_seen) brace_.emplace(input.prepared, input.model);
  if (cost_) regulator_.emplace(input.model, input.muscles, input.length, input.limit, regulated(gain_, options));
  if (options.lesson) options.lesson->make_room(activation_.size(), state_.x.size(), steps_);
  if (!options.trace) return;
  result_.trace = empty_trace(input.scene.body, steps_ + 1);
  input.feed_forward(0, mean_activation_);
  physics::clear(step_impulses_);
  write_trace(0);
}

/// Once a cycle, by what is seen of the body. What steers by its stretching needs no other way.
void Run::keep_way() {
  const double period = target_.duration_s();
  if (!options_.keep_way || !target_.loop || stride_.steers() || time_s_ + 1e-9 < static_cast<double>(cycles_ + 1) * period) return;
  ++cycles_;
  const WayError error = return_map_.way_error(fit_, cycles_);
  return_map_.end_cycle(error);
  if (leap_.is_needed()) leap_.end_cycle(error);
  const bool is_there_time = time_s_ + period <= options_.duration_s + 1e-9;
  if (return_map_.wants_to_learn() && is_there_time) learn_to_steer();
}

/// What others have asked before counts as time of this run, too.
void Run::learn_to_steer() {
  if (!input_.answers) return return_map_.learn(ask_model());
  const ModelAnswers::Answered answered = input_.answers->of(options_, [this] { return ask_model(); });
  busy_s_ += answered.seconds;
  return_map_.learn(answered.errors);
}

/// What ReturnMap::learn wants to know: the body that the corrector believes in goes for a cycle as often as that, each time from the
/// target's start on, wherever this run is.
ReturnMap::Answers Run::ask_model() const {
  const ReplayInput believed{input_.model,        input_.model,     input_.prepared,    input_.muscles,
                             input_.feed_forward, input_.clip_skin, input_.skin_points, input_.clip_rise,
                             input_.length,       input_.size,      input_.limit,    input_.path};
  ReplayOptions alone = options_;
  alone.duration_s = 2 * target_.duration_s();
  alone.observation = {};
  alone.pushes.clear();
  alone.moves.clear();
  alone.trace = false;
  alone.lesson = nullptr;
  Run first(believed, alone, cost_);
  ReturnMap::Answers errors;
  errors.col(0) = first.go_for_a_cycle(ReturnMap::trial(0));
  for (int k = 0; k <= ReturnMap::kHandles; ++k) {
    Run second(believed, alone, cost_);
    second.state_ = first.state_;
    second.time_s_ = first.time_s_;
    second.cycles_ = 1;
    errors.col(k + 1) = second.go_for_a_cycle(ReturnMap::trial(k));
  }
  return errors;
}

/// Nothing is measured but the error of the way at its end; NaN where the simulation diverged.
WayError Run::go_for_a_cycle(const ReturnMap::Handles& handles) {
  return_map_.set(handles);
  const double end = static_cast<double>(cycles_ + 1) * target_.duration_s();
  while (time_s_ + 1e-9 < end) {
    control();
    if (advance() == physics::Termination::kDiverged) return WayError::Constant(std::nan(""));
    look_at_body();
  }
  look_at_way(state_, time_s_);
  return return_map_.way_error(fit_, cycles_ + 1);
}

/// Where the body is, as far as can be told by what is seen of it.
const physics::State& Run::estimate() {
  const physics::State& seen = observer_.see(state_);
  const double then_s = std::max(0.0, time_s_ - static_cast<double>(observer_.delay_steps()) * control_s_);
  curve_.at(then_s, path_then_.x, path_then_.v);
  path_.apply(then_s, path_then_);
  curve_.at(time_s_, reference_.x, reference_.v);
  path_.apply(time_s_, reference_);
  return estimate_.next(seen, path_then_, reference_);
}

/// How far what is seen of the body is from where it would be by the signals alone, on a slope by them and as it leans.
void Run::look_at_way(const physics::State& seen, double time_s) {
  curve_.at(time_s, reference_.x, reference_.v);
  path_.apply(time_s, reference_);
  fit_ = best_rigid_fit(reference_.x, seen.x, mass_shares_);
  if (lean_.is_needed()) fit_.mean_b -= (fit_.mean_a.y() - input_.model.ground.offset) * lean_.at(way_now(time_s));
}

/// [rad] by which the body's path has turned since the target's first frame, as the body heads.
double Run::way_now(double time_s) const {
  const double turned = target_.loop ? target_.yaw * time_s / target_.duration_s() : 0;
  return turned + yaw_of(fit_.rotation);
}

/// The turn from the target's first period to where the glided reference is.
Eigen::Matrix3d Run::heading_now() const {
  const long cycle = target_.loop ? static_cast<long>(std::floor(time_s_ / target_.duration_s() + 1e-9)) : 0;
  return Eigen::AngleAxisd(glide_.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix() * after_cycles(target_, cycle).linear();
}

/// What this control step teaches about the path.
void Run::take_note(const physics::State& seen) {
  Lesson& lesson = *options_.lesson;
  const auto step = std::lround(time_s_ / control_s_);
  if (step >= lesson.time_s.size()) return;
  const Eigen::Matrix3d back = heading_now().transpose();
  lesson.time_s[step] = time_s_;
  input_.feed_forward(time_s_ + 0.5 * control_s_, mean_activation_);
  lesson.added.col(step) = activation_ - mean_activation_;
  lesson.place.col(step) = (back * (seen.x - glided_.x)).reshaped();
  lesson.velocity.col(step) = (back * (seen.v - glided_.v)).reshaped();
}

/// Adds the correction to activation_: of a small deviation the regulator's, for there the motion is as linear as its plan takes it to be.
void Run::correct(const physics::State& seen) {
  Corrector* one = &corrector_;
  Corrector* other = regulator_ ? &*regulator_ : nullptr;
  const bool is_near = cost_ && cost_->of(deviation_along(cost_->modes(), heading_now(), seen, glided_, input_.length, wave_speed_), time_s_) <
                                    options_.corrector.regulator.reach;
  if (is_near) {
    std::swap(one, other);
    one->regulate(*cost_, time_s_, heading_now(), seen, glided_, contact_, activation_);
  } else {
    one->correct(seen, glided_, contact_, activation_);
  }
  correction_ = one->muscles_now();
  if (other) other->follow(correction_);
}

/// The correction for the coming control step, by what is seen of the body.
void Run::control() {
  if (!options_.correct) return;
  const physics::State& seen = options_.observation.is_exact() ? state_ : estimate();
  look_at_way(seen, time_s_);
  glided_ = reference_;
  glide_.follow(fit_, control_s_);
  glide_.apply(fit_.mean_a, glided_);
  if (options_.keep_way) stride_.follow(fit_, control_s_);
  if (brace_) brace_->follow(fit_, reference_, seen, time_s_, control_s_);
  keep_way();
  leap_.apply(time_s_, glide_.yaw, yaw_of(fit_.rotation), physics::centre_of_mass(input_.scene.body, glided_.x), glided_);
  contact_.upright = leap_.upright(time_s_);
  planned_.look(time_s_, gain_.horizon_s, uneven_.has_value(), contact_);
  if (uneven_) {
    uneven_->look(time_s_, control_s_, fit_, seen);
    uneven_->lead(contact_.in_air, seen, glided_, gain_.foot_settle_s, contact_.lead);
    uneven_->apply(physics::centre_of_mass(input_.scene.body, glided_.x), glided_);
  }
  if (lean_.is_needed()) lean_.apply(lean_.at(way_now(time_s_)), input_.scene.body.edges, glided_);
  command(time_s_ + 0.5 * control_s_);
  feedback_ = -activation_;
  correct(seen);
  feedback_ += activation_;
  if (options_.lesson) take_note(seen);
}

/// The activations of a time, but for the corrector's.
void Run::command(double time_s) {
  input_.feed_forward(time_s, activation_);
  signals_ = activation_;
  if (strength_) {
    curve_.at(time_s, commanded_.x, commanded_.v);
    path_.apply(time_s, commanded_);
    strength_->apply(commanded_.x, activation_);
  }
  lean_.apply(activation_);
  stride_.apply(time_s, activation_);
  if (brace_) brace_->apply(activation_);
  return_map_.apply(time_s, activation_);
}

/// The activations at a time within the control step: signals that are held would come in jerks, which shake feet loose that hold
/// by friction. Feedback comes at once, for what comes later balances worse.
void Run::activate(double share_of_step) {
  command(time_s_ + share_of_step * control_s_);
  activation_ += feedback_;
  activation_ = activation_.cwiseMax(1 - input_.limit).cwiseMin(1 + input_.limit);
}

physics::Termination Run::advance() {
  physics::clear(step_impulses_);
  mean_activation_.setZero();
  mean_feedback_.setZero();
  physics::Termination termination = physics::Termination::kDone;
  for (int k = 0; k < options_.steps_per_control; ++k) {
    const double begin = time_s_ + k * options_.step_s;
    const Eigen::Vector3d pushed = pushed_velocity(options_.pushes, begin, begin + options_.step_s);
    const bool has_effect = !effects_.empty() || !pushed.isZero(0);
    if (has_effect) effect_ = (pushed / options_.step_s) * input_.scene.body.mass.transpose();
    for (const auto& effect : effects_) effect->add_forces(options_.step_s, state_, effect_);
    if (moving_) move_obstacles(options_.moves, begin, options_.step_s, moving_->obstacles);
    activate((k + 0.5) / options_.steps_per_control);
    mean_activation_ += activation_ / options_.steps_per_control;
    mean_feedback_ += (activation_ - signals_) / options_.steps_per_control;
    const bool looks = strength_ && k == options_.steps_per_control - 1;  // what feedback jerks has passed
    if (looks) before_ = state_;
    termination = stepper_->step(options_.step_s, activation_, has_effect ? &effect_ : nullptr, state_, impulses_);
    if (looks) strength_->look(options_.step_s, before_, state_, activation_, impulses_);
    physics::add(impulses_, step_impulses_);
    if (termination == physics::Termination::kDiverged) {
      time_s_ = begin;  // of the state that is left
      return termination;
    }
    slip_.add(begin + options_.step_s, state_, impulses_.contact);
  }
  time_s_ += control_s_;
  return termination;
}

void Run::write_trace(long row) {
  Trace& trace = result_.trace;
  trace.time_s[row] = time_s_;
  trace.position.col(row) = column(state_.x);
  trace.velocity.col(row) = column(state_.v);
  trace.activation.col(row) = mean_activation_;
  trace.contact_force.col(row) = column(step_impulses_.contact_nodes) / control_s_;
  trace.effect_force.col(row) = column(step_impulses_.effect_nodes) / control_s_;
  trace.correction_impulse.col(row) = column(step_impulses_.correction_nodes);
  trace.contact_moment.col(row) = step_impulses_.contact_moment / control_s_;
  trace.effect_moment.col(row) = step_impulses_.effect_moment / control_s_;
}

/// Where the body is and what touches it, after a control step.
void Run::look_at_body() {
  curve_.at(time_s_, reference_.x, reference_.v);
  fit_ = best_rigid_fit(reference_.x, state_.x, mass_shares_);
  contact_.touching = point_states(input_.scene, state_, step_impulses_.contact, thresholds_);
  contact_.force = step_impulses_.contact / control_s_;
}

void Run::measure(long step) {
  if (options_.trace) write_trace(step);
  if (step % steps_per_frame_ == 0) frames_.emplace_back(column(state_.x));
  metrics_.add(
      {time_s_, state_, reference_, fit_, mean_activation_, mean_feedback_, correction_, step_impulses_, contact_.touching});
}

/// A fall is told some time after it began; its cause is what was seen then.
void Run::watch_for_fall() {
  const bool was_falling = fall_watch_.seconds() > 0, has_fallen = fall_watch_.has_fallen(plant_.ground, fit_, control_s_);
  if (!was_falling && fall_watch_.seconds() > 0) {
    falling_ = Fall{time_s_ - fall_watch_.seconds(), fall_cause(input_, state_, reference_, fit_, activation_, time_s_)};
  }
  if (has_fallen) fall_ = falling_;
}

Replay Run::play() {
  long step = 1;
  for (; step <= steps_ && !fall_; ++step) {
    const double began = thread_seconds();
    control();
    result_.termination = advance();
    if (result_.termination == physics::Termination::kDone) look_at_body();
    busy_s_ += thread_seconds() - began;
    if (result_.termination == physics::Termination::kDiverged) {
      fall_ = Fall{time_s_, "the simulation diverged: " +
                                divergence_cause(input_.scene.body, state_, options_.method, options_.step_s, time_s_)};
      break;
    }
    measure(step);
    if (plant_.has_ground) watch_for_fall();
  }
  return finish(step);
}

/// `rows` control states were reached, the first among them.
Replay Run::finish(long rows) {
  ReplayReport& report = result_.report;
  report = metrics_.figures();
  report.slip_per_stance_length = slip_.per_stance() / input_.length;
  report.held_slip_per_stance_length = slip_.held_per_stance() / input_.length;
  report.guard_steps = static_cast<int>(stepper_->guard_steps());
  report.real_time_factor = busy_s_ > 0 ? time_s_ / busy_s_ : 0;
  if (fall_) {
    report.fell = true;
    report.fall_time_s = fall_->time_s;
    report.fall_cause = fall_->cause;
  }
  result_.course = metrics_.course();
  if (options_.lesson) options_.lesson->cut(std::min<Eigen::Index>(rows - 1, options_.lesson->time_s.size()));
  result_.motion.rate_hz = 1 / (static_cast<double>(steps_per_frame_) * control_s_);
  result_.motion.frames.resize(state_.x.size(), static_cast<Eigen::Index>(frames_.size()));
  for (std::size_t f = 0; f < frames_.size(); ++f) result_.motion.frames.col(static_cast<Eigen::Index>(f)) = frames_[f];
  if (options_.trace) shorten(result_.trace, rows);
  return std::move(result_);
}

}  // namespace

double usual_duration(const Motion& target) {
  if (!target.loop) return target.duration_s() + 1;
  return target.duration_s() * std::max(1.0, std::min(15.0, std::floor(10 / target.duration_s() + 1e-9)));
}

Replay replay(const ReplayInput& input, const ReplayOptions& options) { return Run(input, options).play(); }

}  // namespace hydrostat::retarget

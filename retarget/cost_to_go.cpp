#include "retarget/cost_to_go.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "retarget/dense_product.h"
#include "retarget/equilibrium.h"
#include "retarget/linear_step.h"

namespace hydrostat::retarget {
namespace {

constexpr double kForgotten = 1;      // [s] ahead, from which on the end of a recursion does not matter
constexpr long kSamples = 12;         // moments that modes are found in
constexpr long kMostMatrices = 400;   // that are kept
constexpr double kEndWeight = 10;     // of a deviation at the end, over that of a step

/// The planned motion halfway through its control steps, where its forces balance.
class Moments {
 public:
  Moments(const RegulatedMotion& motion, double control_s)
      : motion_(motion),
        target_(motion.prepared.target),
        curve_(target_),
        path_(motion.path),
        equilibrium_(motion.scene, motion.length),
        steps_(std::max(1L, std::lround(target_.duration_s() / control_s))),
        step_s_(target_.duration_s() > 0 ? target_.duration_s() / static_cast<double>(steps_) : control_s) {}

  long steps() const { return steps_; }
  double step_s() const { return step_s_; }

  /// `settling`: by how much it has moved from the plan [m], 3 x N.
  PlannedMoment at(long step, Eigen::Matrix3Xd& settling) {
    const double time_s = (static_cast<double>(step) + 0.5) * step_s_;
    PlannedMoment moment;
    moment.state = planned(time_s);
    moment.activation.resize(motion_.scene.body.edge_count());
    motion_.feed_forward(time_s, moment.activation);
    const ContactSchedule& contacts = motion_.prepared.contacts;
    const auto points = static_cast<std::size_t>(motion_.scene.contact_points.count());
    moment.touching.assign(points, ContactState::kOff);
    moment.patch.assign(points, -1);
    const Eigen::Index frame = frame_at(target_, time_s);
    for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
      const ContactState state = contacts.state[k][static_cast<std::size_t>(frame)];
      for (const int p : contacts.patches[k].points) {
        if (!contacts.touching(p, frame)) continue;
        moment.touching[static_cast<std::size_t>(p)] = state == ContactState::kSlide ? state : ContactState::kStick;
        moment.patch[static_cast<std::size_t>(p)] = static_cast<int>(k);
      }
    }
    const physics::State planned = moment.state;
    equilibrium_.settle(acceleration(time_s), moment);
    settling = moment.state.x - planned.x;
    return moment;
  }
  std::vector<PlannedMoment> some() {
    std::vector<PlannedMoment> moments;
    const long count = std::min(kSamples, steps_);
    Eigen::Matrix3Xd settling;
    for (long k = 0; k < count; ++k) moments.push_back(at(k * steps_ / count, settling));
    return moments;
  }

 private:
  physics::State planned(double time_s) {
    physics::State state;
    curve_.at(time_s, state.x, state.v);
    path_.apply(time_s, state);
    return state;
  }
  /// The mean over a frame, 3 x N [m/s2].
  Eigen::Matrix3Xd acceleration(double time_s) {
    const double half_s = 0.5 / target_.rate_hz;
    return (planned(time_s + half_s).v - planned(time_s - half_s).v) * target_.rate_hz;
  }

  const RegulatedMotion& motion_;
  const Motion& target_;
  const MotionCurve curve_;
  NominalPathCurve path_;
  Equilibrium equilibrium_;
  const long steps_;
  const double step_s_;
};

/// S, T and p, see find_cost_to_go.
struct Costs {
  Eigen::MatrixXd of_deviation, of_disturbance;
  Eigen::VectorXd pull;
};

/// A step of the plan.
struct PlannedStep {
  LinearStep linear;      // about where forces balance
  Eigen::VectorXd drift;  // R: what it makes of the speeds of a body on the plan, where they do not
};

/// One step earlier.
void go_back(const PlannedStep& planned, const Eigen::VectorXd& weights, const RegulatorOptions& options, Costs& costs) {
  const LinearStep& step = planned.linear;
  Eigen::MatrixXd& cost = costs.of_deviation;
  const Eigen::Index modes = step.drive.rows();
  const CostByStep next = by_step(cost, step.advance);
  Eigen::MatrixXd carried = product_of_transposed(step.carry, next.of_speeds);  // 2R x R: F^T S P
  carried.topRows(modes) += next.with_step.topRows(modes);
  Eigen::MatrixXd left = product(product_of_transposed(step.drive, next.of_speeds), step.drive);
  left.diagonal().array() += options.effort;
  const Eigen::MatrixXd coupled = product(carried, step.drive), gains = left.ldlt().solve(coupled.transpose());

  const Eigen::MatrixXd ahead = cost + options.last * costs.of_disturbance;
  const Eigen::MatrixXd ahead_by_step = step.advance * ahead.topRows(modes) + ahead.bottomRows(modes);  // R x 2R: P^T ahead
  const Eigen::MatrixXd closed = step.carry - product(step.drive, gains);
  costs.of_disturbance = product_of_transposed(closed, ahead_by_step);
  costs.of_disturbance.topRows(modes) += ahead.topRows(modes);

  const Eigen::VectorXd pull = costs.pull + next.with_step * planned.drift;
  costs.pull = closed.transpose() * (step.advance * pull.head(modes) + pull.tail(modes));
  costs.pull.head(modes) += pull.head(modes);

  const Eigen::MatrixXd by_place = product(next.with_step.topRows(modes), step.carry);  // R x 2R
  const Eigen::MatrixXd of_places = cost.topLeftCorner(modes, modes);
  cost = product_of_transposed(step.carry, product(next.of_speeds, step.carry));
  cost.topRows(modes) += by_place;
  cost.leftCols(modes) += by_place.transpose();
  cost.topLeftCorner(modes, modes) += of_places;
  cost -= product(coupled, gains);
  cost = (0.5 * (cost + cost.transpose())).eval();
  cost.diagonal() += weights;
}

/// What a deviation along the modes becomes as the next period sees it, that begins turned by `yaw`, R x R.
Eigen::MatrixXd into_next_period(const ReducedModes& modes, double yaw) {
  const Eigen::Matrix3d back = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  Eigen::MatrixXd turned(modes.fields.rows(), modes.count());
  for (Eigen::Index i = 0; i < turned.rows(); i += 3) turned.middleRows<3>(i) = back * modes.fields.middleRows<3>(i);
  return modes.project * turned;
}

}  // namespace

CostByStep by_step(const Eigen::MatrixXd& cost, double advance) {
  const Eigen::Index modes = cost.rows() / 2;
  CostByStep result;
  result.with_step = advance * cost.leftCols(modes) + cost.rightCols(modes);
  result.of_speeds = advance * result.with_step.topRows(modes) + result.with_step.bottomRows(modes);
  return result;
}

std::size_t CostToGo::step_at(double time_s) const {
  const long count = static_cast<long>(costs_.size()), step = std::lround(time_s / spacing_s_);
  return static_cast<std::size_t>(is_loop_ ? (step % count + count) % count : std::clamp(step, 0L, count - 1));
}

physics::State CostToGo::settled(double time_s, const Eigen::Matrix3d& heading, const physics::State& planned) const {
  physics::State state = planned;
  state.x += heading * settling_[step_at(time_s)];
  return state;
}

Eigen::VectorXd deviation_along(const ReducedModes& modes, const Eigen::Matrix3d& heading, const physics::State& state,
                                const physics::State& reference, double length, double wave_speed) {
  Eigen::VectorXd deviation(2 * modes.count());
  deviation << modes.project * (heading.transpose() * (state.x - reference.x)).reshaped() / length,
      modes.project * (heading.transpose() * (state.v - reference.v)).reshaped() / wave_speed;
  return deviation;
}

CostToGo find_cost_to_go(const RegulatedMotion& motion, double control_s, const RegulatorOptions& options) {
  const Motion& target = motion.prepared.target;
  Moments moments(motion, control_s);
  CostToGo result;
  result.modes_ = find_reduced_modes(motion.scene, motion.muscles, moments.some(), motion.length, options.modes);
  result.is_loop_ = target.loop;
  const long steps = moments.steps(), apart = (steps + kMostMatrices - 1) / kMostMatrices, count = (steps + apart - 1) / apart;
  result.spacing_s_ = static_cast<double>(apart) * moments.step_s();
  result.costs_.resize(static_cast<std::size_t>(count));
  result.disturbed_.resize(result.costs_.size());
  result.pulls_.resize(result.costs_.size());
  result.settling_.resize(result.costs_.size());
  LinearSteps linear(motion.scene, motion.muscles, result.modes_, motion.length, moments.step_s());

  const double mass = motion.scene.body.mass.sum();
  const Eigen::Index modes = result.modes_.count();
  Eigen::VectorXd weights(2 * modes);
  weights.head(modes).setConstant(options.place / mass);
  weights.tail(modes).setConstant(options.speed / mass);
  Costs costs{(kEndWeight * weights).asDiagonal(), Eigen::MatrixXd::Zero(2 * modes, 2 * modes), Eigen::VectorXd::Zero(2 * modes)};
  const long ahead = std::lround(kForgotten / moments.step_s());
  const Eigen::MatrixXd turn = into_next_period(result.modes_, target.loop ? target.yaw : 0);
  const auto pass_seam = [&] {
    if (!target.loop || target.yaw == 0) return;
    for (Eigen::MatrixXd* cost : {&costs.of_deviation, &costs.of_disturbance}) {
      for (const Eigen::Index r : {Eigen::Index{0}, modes}) {
        cost->middleRows(r, modes) = (turn.transpose() * cost->middleRows(r, modes)).eval();
        cost->middleCols(r, modes) = (cost->middleCols(r, modes) * turn).eval();
      }
    }
    for (const Eigen::Index r : {Eigen::Index{0}, modes}) costs.pull.segment(r, modes) = (turn.transpose() * costs.pull.segment(r, modes)).eval();
  };
  std::vector<PlannedStep> known(static_cast<std::size_t>(target.loop && steps <= ahead ? steps : 0));  // a short loop comes by again and again
  const auto find_step = [&](long k) {
    Eigen::Matrix3Xd settling;
    PlannedStep step{linear.at(moments.at(k, settling)), {}};
    step.drift = step.linear.carry.leftCols(modes) * (result.modes_.project * settling.reshaped()) / -motion.length;
    if (k % apart == 0 && k < steps) result.settling_[static_cast<std::size_t>(k / apart)] = std::move(settling);
    return step;
  };
  const auto step_at = [&](long k) {
    if (known.empty()) return find_step(k);
    PlannedStep& step = known[static_cast<std::size_t>(k)];
    if (step.drift.size() == 0) step = find_step(k);
    return step;
  };
  if (target.loop) {
    for (long k = ahead - 1; k >= 0; --k) {
      go_back(step_at(k % steps), weights, options, costs);
      if (k % steps == 0) pass_seam();
    }
  } else {
    const PlannedStep standing = find_step(steps);
    for (long k = 0; k < ahead; ++k) go_back(standing, weights, options, costs);
  }
  for (long k = steps - 1; k >= 0; --k) {
    go_back(step_at(k), weights, options, costs);
    if (k % apart != 0) continue;
    result.costs_[static_cast<std::size_t>(k / apart)] = costs.of_deviation.cast<float>();
    result.disturbed_[static_cast<std::size_t>(k / apart)] = costs.of_disturbance.cast<float>();
    result.pulls_[static_cast<std::size_t>(k / apart)] = costs.pull.cast<float>();
  }
  result.is_sound_ = costs.of_deviation.allFinite() && costs.of_disturbance.allFinite() && costs.pull.allFinite();
  return result;
}

}  // namespace hydrostat::retarget

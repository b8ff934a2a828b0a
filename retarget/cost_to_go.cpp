#include "retarget/cost_to_go.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "retarget/dense_product.h"
#include "retarget/equilibrium.h"
#include "retarget/linear_step.h"

namespace hydrostat::retarget {
namespace {

constexpr double kForgotten = 1;     // [s] ahead, from which on the end of a recursion does not matter
constexpr long kMoments = 12;        // moments that modes are found in
constexpr long kMostMatrices = 400;  // that are kept
constexpr double kEndWeight = 10;    // of a deviation at the end, over that of a step

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
    const long count = std::min(kMoments, steps_);
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

/// A step of the plan.
struct PlannedStep {
  LinearStep linear;         // about where forces balance
  Eigen::Matrix3Xd settling; // [m]: from the plan to there, 3 x N
  Eigen::VectorXd drift;     // R: what it makes of the speeds of a body on the plan, where they do not
};

/// All steps of the plan, each found once where the recursion comes by again and again.
class PlannedSteps {
 public:
  PlannedSteps(const RegulatedMotion& motion, const ReducedModes& modes, bool are_kept, Moments& moments)
      : length_(motion.length),
        modes_(modes),
        moments_(moments),
        linear_(motion.scene, motion.muscles, modes, motion.length, moments.step_s()),
        known_(static_cast<std::size_t>(are_kept ? moments.steps() : 0)) {}

  PlannedStep at(long k) {
    if (known_.empty()) return find(k);
    PlannedStep& step = known_[static_cast<std::size_t>(k)];
    if (step.drift.size() == 0) step = find(k);
    return step;
  }

 private:
  PlannedStep find(long k) {
    PlannedStep step;
    step.linear = linear_.at(moments_.at(k, step.settling));
    step.drift = step.linear.carry.leftCols(modes_.count()) * (modes_.project * step.settling.reshaped()) / -length_;
    return step;
  }

  const double length_;
  const ReducedModes& modes_;
  Moments& moments_;
  LinearSteps linear_;
  std::vector<PlannedStep> known_;
};

/// S, T and p of a moment, see find_cost_to_go.
class Recursion {
 public:
  /// Begins where the motion ends. `turn` is what a loop does to the modes from period to period, R x R; none where it does not turn.
  Recursion(Eigen::Index modes, double mass, const RegulatorOptions& options, std::optional<Eigen::MatrixXd> turn)
      : options_(options), turn_(std::move(turn)), weights_(2 * modes), disturbed_(Eigen::MatrixXd::Zero(2 * modes, 2 * modes)) {
    weights_.head(modes).setConstant(options.place / mass);
    weights_.tail(modes).setConstant(options.speed / mass);
    cost_ = (kEndWeight * weights_).asDiagonal();
    pull_.setZero(2 * modes);
  }

  void go_back(const PlannedStep& planned);
  /// From the begin of a period to the end of the one before.
  void pass_seam();

  const Eigen::MatrixXd& cost() const { return cost_; }
  const Eigen::MatrixXd& disturbed() const { return disturbed_; }
  const Eigen::VectorXd& pull() const { return pull_; }
  bool is_sound() const { return cost_.allFinite() && disturbed_.allFinite() && pull_.allFinite(); }

 private:
  const RegulatorOptions options_;
  const std::optional<Eigen::MatrixXd> turn_;
  Eigen::VectorXd weights_, pull_;
  Eigen::MatrixXd cost_, disturbed_;
};

/// One step earlier.
void Recursion::go_back(const PlannedStep& planned) {
  const LinearStep& step = planned.linear;
  const Eigen::Index modes = step.drive.rows();
  const CostByStep next = by_step(cost_, step.advance);
  Eigen::MatrixXd carried = product_of_transposed(step.carry, next.of_speeds);  // 2R x R: F^T S P
  carried.topRows(modes) += next.with_step.topRows(modes);
  Eigen::MatrixXd left = product(product_of_transposed(step.drive, next.of_speeds), step.drive);
  left.diagonal().array() += options_.effort;
  const Eigen::MatrixXd coupled = product(carried, step.drive), gains = left.ldlt().solve(coupled.transpose());

  const Eigen::MatrixXd ahead = cost_ + options_.last * disturbed_;
  const Eigen::MatrixXd ahead_by_step = step.advance * ahead.topRows(modes) + ahead.bottomRows(modes);  // R x 2R: P^T ahead
  const Eigen::MatrixXd closed = step.carry - product(step.drive, gains);
  disturbed_ = product_of_transposed(closed, ahead_by_step);
  disturbed_.topRows(modes) += ahead.topRows(modes);

  const Eigen::VectorXd pull = pull_ + next.with_step * planned.drift;
  pull_ = closed.transpose() * (step.advance * pull.head(modes) + pull.tail(modes));
  pull_.head(modes) += pull.head(modes);

  const Eigen::MatrixXd by_place = product(next.with_step.topRows(modes), step.carry);  // R x 2R
  const Eigen::MatrixXd of_places = cost_.topLeftCorner(modes, modes);
  cost_ = product_of_transposed(step.carry, product(next.of_speeds, step.carry));
  cost_.topRows(modes) += by_place;
  cost_.leftCols(modes) += by_place.transpose();
  cost_.topLeftCorner(modes, modes) += of_places;
  cost_ -= product(coupled, gains);
  cost_ = (0.5 * (cost_ + cost_.transpose())).eval();
  cost_.diagonal() += weights_;
}

void Recursion::pass_seam() {
  if (!turn_) return;
  const Eigen::Index modes = turn_->rows();
  for (Eigen::MatrixXd* cost : {&cost_, &disturbed_}) {
    for (const Eigen::Index r : {Eigen::Index{0}, modes}) {
      cost->middleRows(r, modes) = (turn_->transpose() * cost->middleRows(r, modes)).eval();
      cost->middleCols(r, modes) = (cost->middleCols(r, modes) * *turn_).eval();
    }
  }
  for (const Eigen::Index r : {Eigen::Index{0}, modes}) pull_.segment(r, modes) = (turn_->transpose() * pull_.segment(r, modes)).eval();
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

  const long ahead = std::lround(kForgotten / moments.step_s());
  PlannedSteps planned(motion, result.modes_, target.loop && steps <= ahead, moments);
  std::optional<Eigen::MatrixXd> turn;
  if (target.loop && target.yaw != 0) turn = into_next_period(result.modes_, target.yaw);
  Recursion recursion(result.modes_.count(), motion.scene.body.mass.sum(), options, std::move(turn));
  if (target.loop) {
    for (long k = ahead - 1; k >= 0; --k) {
      recursion.go_back(planned.at(k % steps));
      if (k % steps == 0) recursion.pass_seam();
    }
  } else {
    const PlannedStep standing = planned.at(steps);
    for (long k = 0; k < ahead; ++k) recursion.go_back(standing);
  }
  for (long k = steps - 1; k >= 0; --k) {
    PlannedStep step = planned.at(k);
    recursion.go_back(step);
    if (k % apart != 0) continue;
    const auto place = static_cast<std::size_t>(k / apart);
    result.costs_[place] = recursion.cost().cast<float>();
    result.disturbed_[place] = recursion.disturbed().cast<float>();
    result.pulls_[place] = recursion.pull().cast<float>();
    result.settling_[place] = std::move(step.settling);
  }
  result.is_sound_ = recursion.is_sound();
  return result;
}

}  // namespace hydrostat::retarget

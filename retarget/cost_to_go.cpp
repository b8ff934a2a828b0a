#include "retarget/cost_to_go.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "retarget/dense_product.h"
#include "retarget/linear_step.h"

namespace hydrostat::retarget {
namespace {

constexpr double kForgotten = 1;      // [s] ahead, from which on the end of a recursion does not matter
constexpr long kSamples = 12;         // moments that modes are found in
constexpr long kMostMatrices = 400;   // that are kept
constexpr double kEndWeight = 10;     // of a deviation at the end, over that of a step

/// The planned motion in control steps.
class Moments {
 public:
  Moments(const RegulatedMotion& motion, double control_s)
      : motion_(motion),
        target_(motion.prepared.target),
        curve_(target_),
        path_(motion.path),
        steps_(std::max(1L, std::lround(target_.duration_s() / control_s))),
        step_s_(target_.duration_s() > 0 ? target_.duration_s() / static_cast<double>(steps_) : control_s) {}

  long steps() const { return steps_; }
  double step_s() const { return step_s_; }

  PlannedMoment at(long step) {
    const double time_s = static_cast<double>(step) * step_s_;
    PlannedMoment moment;
    curve_.at(time_s, moment.state.x, moment.state.v);
    path_.apply(time_s, moment.state);
    moment.activation.resize(motion_.scene.body.edge_count());
    motion_.feed_forward(time_s + 0.5 * step_s_, moment.activation);
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
    return moment;
  }
  std::vector<PlannedMoment> some() {
    std::vector<PlannedMoment> moments;
    const long count = std::min(kSamples, steps_);
    for (long k = 0; k < count; ++k) moments.push_back(at(k * steps_ / count));
    return moments;
  }

 private:
  const RegulatedMotion& motion_;
  const Motion& target_;
  const MotionCurve curve_;
  NominalPathCurve path_;
  const long steps_;
  const double step_s_;
};

/// S and T, see find_cost_to_go.
struct Costs {
  Eigen::MatrixXd of_deviation, of_disturbance;
};

/// One step earlier.
void go_back(const LinearStep& step, const Eigen::VectorXd& weights, const RegulatorOptions& options, Costs& costs) {
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
  costs.of_disturbance = product_of_transposed(step.carry - product(step.drive, gains), ahead_by_step);
  costs.of_disturbance.topRows(modes) += ahead.topRows(modes);

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
  LinearSteps linear(motion.scene, motion.muscles, result.modes_, motion.length, moments.step_s());

  const double mass = motion.scene.body.mass.sum();
  const Eigen::Index modes = result.modes_.count();
  Eigen::VectorXd weights(2 * modes);
  weights.head(modes).setConstant(options.place / mass);
  weights.tail(modes).setConstant(options.speed / mass);
  Costs costs{(kEndWeight * weights).asDiagonal(), Eigen::MatrixXd::Zero(2 * modes, 2 * modes)};
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
  };
  std::vector<LinearStep> known(static_cast<std::size_t>(target.loop && steps <= ahead ? steps : 0));  // a short loop comes by again and again
  const auto step_at = [&](long k) {
    if (known.empty()) return linear.at(moments.at(k));
    LinearStep& step = known[static_cast<std::size_t>(k)];
    if (step.carry.size() == 0) step = linear.at(moments.at(k));
    return step;
  };
  if (target.loop) {
    for (long k = ahead - 1; k >= 0; --k) {
      go_back(step_at(k % steps), weights, options, costs);
      if (k % steps == 0) pass_seam();
    }
  } else {
    const LinearStep standing = linear.at(moments.at(steps));
    for (long k = 0; k < ahead; ++k) go_back(standing, weights, options, costs);
  }
  for (long k = steps - 1; k >= 0; --k) {
    go_back(step_at(k), weights, options, costs);
    if (k % apart != 0) continue;
    result.costs_[static_cast<std::size_t>(k / apart)] = costs.of_deviation.cast<float>();
    result.disturbed_[static_cast<std::size_t>(k / apart)] = costs.of_disturbance.cast<float>();
  }
  result.is_sound_ = costs.of_deviation.allFinite() && costs.of_disturbance.allFinite();
  return result;
}

}  // namespace hydrostat::retarget

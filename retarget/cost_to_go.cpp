#include "retarget/cost_to_go.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

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
    moment.touching.assign(static_cast<std::size_t>(motion_.scene.contact_points.count()), ContactState::kOff);
    const Eigen::Index frame = frame_at(target_, time_s);
    for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
      const ContactState state = contacts.state[k][static_cast<std::size_t>(frame)];
      for (const int p : contacts.patches[k].points) {
        if (contacts.touching(p, frame)) moment.touching[static_cast<std::size_t>(p)] = state == ContactState::kSlide ? state : ContactState::kStick;
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

/// S one step earlier.
void go_back(const LinearStep& step, const Eigen::VectorXd& weights, double effort, Eigen::MatrixXd& cost) {
  const Eigen::MatrixXd driven = cost * step.drive, carried = cost * step.carry;
  Eigen::MatrixXd left = step.drive.transpose() * driven;
  left.diagonal().array() += effort;
  const Eigen::MatrixXd coupled = step.carry.transpose() * driven;
  cost.noalias() = step.carry.transpose() * carried;
  cost.noalias() -= coupled * left.ldlt().solve(coupled.transpose());
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
  LinearSteps linear(motion.scene, motion.muscles, result.modes_, motion.length, moments.step_s());

  const double mass = motion.scene.body.mass.sum();
  const Eigen::Index modes = result.modes_.count();
  Eigen::VectorXd weights(2 * modes);
  weights.head(modes).setConstant(options.place / mass);
  weights.tail(modes).setConstant(options.speed / mass);
  Eigen::MatrixXd cost = (kEndWeight * weights).asDiagonal();
  const long ahead = std::lround(kForgotten / moments.step_s());
  const Eigen::MatrixXd turn = into_next_period(result.modes_, target.loop ? target.yaw : 0);
  const auto pass_seam = [&] {
    if (!target.loop || target.yaw == 0) return;
    for (const Eigen::Index r : {Eigen::Index{0}, modes}) {
      cost.middleRows(r, modes) = (turn.transpose() * cost.middleRows(r, modes)).eval();
      cost.middleCols(r, modes) = (cost.middleCols(r, modes) * turn).eval();
    }
  };
  if (target.loop) {
    for (long k = ahead - 1; k >= 0; --k) {
      go_back(linear.at(moments.at(k % steps)), weights, options.effort, cost);
      if (k % steps == 0) pass_seam();
    }
  } else {
    const LinearStep standing = linear.at(moments.at(steps));
    for (long k = 0; k < ahead; ++k) go_back(standing, weights, options.effort, cost);
  }
  for (long k = steps - 1; k >= 0; --k) {
    go_back(linear.at(moments.at(k)), weights, options.effort, cost);
    if (k % apart == 0) result.costs_[static_cast<std::size_t>(k / apart)] = cost.cast<float>();
  }
  result.is_sound_ = cost.allFinite();
  return result;
}

}  // namespace hydrostat::retarget

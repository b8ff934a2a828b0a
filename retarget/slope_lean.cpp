#include "retarget/slope_lean.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "physics/body.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {
namespace {

constexpr double kBase = 0.2;     // of h^2: a base of these second moments saves half of the lean
constexpr double kOnLegs = 0.3;   // floor
constexpr double kDragged = 0;    // the same of what drags itself

/// x and z of a vector from the target's heading at `yaw` to that of its first frame, or back.
Eigen::Rotation2Dd level_turn(double yaw) { return Eigen::Rotation2Dd(-yaw); }

/// The second moments of what bears load about the centre of mass, over that one's squared height; x and z, as the target heads in its
/// first frame, the mean over the frames that have contact.
Eigen::Matrix2d base_of(const PreparedTarget& plan, const physics::Scene& model) {
  const Motion points = point_motion(model.contact_points, plan.target);
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  double height = 0;
  Eigen::Index frames = 0;
  for (Eigen::Index f = 0; f < points.count(); ++f) {
    const auto bearing = plan.contacts.touching.col(f);
    if (!bearing.any()) continue;
    const Eigen::Vector3d com = physics::centre_of_mass(model.body, plan.target.at(f));
    const Eigen::Matrix2d back = level_turn(plan.target.yaw * static_cast<double>(f) / static_cast<double>(points.count())).inverse().matrix();
    Eigen::Matrix2d of_frame = Eigen::Matrix2d::Zero();
    for (Eigen::Index p = 0; p < bearing.size(); ++p) {
      if (!bearing[p]) continue;
      const Eigen::Vector3d arm = points.at(f).col(p) - com;
      const Eigen::Vector2d level = back * Eigen::Vector2d(arm.x(), arm.z());
      of_frame += level * level.transpose();
    }
    moments += of_frame / static_cast<double>(bearing.count());
    height += com.y() - model.ground.offset;
    ++frames;
  }
  if (frames == 0 || height <= 0) return Eigen::Matrix2d::Zero();
  return moments * static_cast<double>(frames) / (height * height);
}

bool is_on_legs(const ContactSchedule& contacts) {
  return std::any_of(contacts.patches.begin(), contacts.patches.end(), [](const Patch& patch) { return patch.on_leg; });
}

}  // namespace

SlopeLean::SlopeLean(const PreparedTarget& plan, const physics::Scene& model)
    : ground_(model.ground.offset), slope_(Eigen::Vector2d::Zero()), share_(Eigen::Matrix2d::Zero()) {
  const Eigen::Vector3d& gravity = model.gravity;
  const bool stands = is_on_legs(plan.contacts);
  const bool is_tilted = gravity.y() < 0 && (gravity.x() != 0 || gravity.z() != 0);
  if (!model.has_ground || !is_tilted || !(stands || is_dragged(plan.contacts))) return;
  slope_ << gravity.x() / gravity.y(), gravity.z() / gravity.y();
  const double floor = stands ? kOnLegs : kDragged;
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity(), base = base_of(plan, model) / kBase;
  share_ = floor * one + (1 - floor) * (one + base * base).inverse();
}

Eigen::Vector3d SlopeLean::at(double yaw) const {
  const Eigen::Rotation2Dd turn = level_turn(yaw);
  const Eigen::Vector2d lean = turn * (share_ * (turn.inverse() * slope_));
  return {lean.x(), 0, lean.y()};
}

void SlopeLean::apply(const Eigen::Vector3d& lean, const Eigen::Matrix2Xi& constraints, physics::State& reference) {
  const auto length = [&](Eigen::Index e) { return (reference.x.col(constraints(1, e)) - reference.x.col(constraints(0, e))).norm(); };
  stretch_.resize(constraints.cols());
  for (Eigen::Index e = 0; e < constraints.cols(); ++e) stretch_[e] = 1 / length(e);
  reference.x += lean * (reference.x.row(1).array() - ground_).matrix();
  reference.v += lean * reference.v.row(1);
  for (Eigen::Index e = 0; e < constraints.cols(); ++e) stretch_[e] *= length(e);
}

void SlopeLean::apply(Eigen::VectorXd& activation) const {
  if (stretch_.size() > 0) activation.array() *= stretch_.array();
}

}  // namespace hydrostat::retarget

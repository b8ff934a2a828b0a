#include "retarget/loop.h"

#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kRestSpeed = 0.1;  // of the clip's RMS speed

}  // namespace

bool was_made_to_be_played_once(const Motion& frames, const Eigen::VectorXd& mass, double flight_height) {
  const Eigen::Index intervals = frames.count() - 1;
  Eigen::VectorXd squared_speed(intervals), lowest(intervals + 1);
  for (Eigen::Index f = 0; f < intervals; ++f) {
    squared_speed[f] = ((frames.at(f + 1) - frames.at(f)).colwise().squaredNorm() * mass)(0);
  }
  for (Eigen::Index f = 0; f <= intervals; ++f) lowest[f] = frames.at(f).row(1).minCoeff();
  const double rest = kRestSpeed * kRestSpeed * squared_speed.mean();
  const double ground = std::max(lowest[0], lowest[intervals]);
  return squared_speed[0] < rest && squared_speed[intervals - 1] < rest && lowest.maxCoeff() > ground + flight_height;
}

Eigen::Matrix3Xd closure_defect(const Motion& loop, const Eigen::Ref<const Eigen::Matrix3Xd>& start,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& end) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(loop.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return end - ((turn * start).colwise() + loop.travel);
}

Eigen::Matrix3Xd closure_move(const Motion& loop, double share, const Eigen::Ref<const Eigen::Matrix3Xd>& defect) {
  const double size = 0.5 * std::pow(std::cos(M_PI * share), 2);
  if (share >= 0.5) return -size * defect;
  return size * Eigen::AngleAxisd(-loop.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix() * defect;
}

Motion close_loop(const Motion& frames, const Eigen::VectorXd& mass, double tolerance, double* defect_out) {
  const Eigen::Index last = frames.count() - 1;
  if (last < 4) return frames;
  const auto first_shape = frames.at(0), last_shape = frames.at(last);
  const double total = mass.sum();
  const Eigen::Vector3d first_com = first_shape * mass / total, last_com = last_shape * mass / total;
  // The turn about y that fits best (the horizontal part of Kabsch's problem has a closed form).
  double along = 0, across = 0;
  for (Eigen::Index i = 0; i < mass.size(); ++i) {
    const Eigen::Vector3d a = first_shape.col(i) - first_com, b = last_shape.col(i) - last_com;
    along += mass[i] * (a.x() * b.x() + a.z() * b.z());
    across += mass[i] * (a.z() * b.x() - a.x() * b.z());
  }
  double yaw = std::atan2(across, along);
  if (std::abs(yaw) < 2e-3) yaw = 0;
  Motion loop = frames;
  loop.loop = true;
  loop.yaw = yaw;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  loop.travel = last_com - turn * first_com;
  loop.travel.y() = 0;
  const Eigen::Matrix3Xd defect = closure_defect(loop, first_shape, last_shape);
  const double rms = std::sqrt((defect.colwise().squaredNorm() * mass)(0) / total);
  if (defect_out != nullptr) *defect_out = rms;
  if (rms > tolerance) return frames;
  loop.frames.conservativeResize(Eigen::NoChange, last);
  for (Eigen::Index f = 0; f < last; ++f) {
    loop.at(f) += closure_move(loop, static_cast<double>(f) / static_cast<double>(last), defect);
  }
  return loop;
}

}  // namespace hydrostat::retarget

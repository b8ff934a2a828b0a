#include "retarget/world.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

/// `course`: 3N x S, a vector for each node.
void turn_all(const Eigen::Matrix3d& turn, Eigen::MatrixXd& course) {
  for (Eigen::Index r = 0; r < course.rows(); r += 3) course.middleRows<3>(r) = turn * course.middleRows<3>(r).eval();
}

void move_all(const Eigen::Vector3d& way, Eigen::MatrixXd& course) {
  for (Eigen::Index r = 0; r < course.rows(); r += 3) course.middleRows<3>(r).colwise() += way;
}

Eigen::Vector3d shift_of(const World& world) { return world.pivot - world.turn * world.pivot; }

/// A moment about the origin of the ground's frame becomes one about the world's.
void turn_moments(const World& world, const Eigen::MatrixXd& force, Eigen::Matrix3Xd& moment) {
  const Eigen::Vector3d shift = shift_of(world);
  for (Eigen::Index s = 0; s < moment.cols(); ++s) {
    const Eigen::Vector3d sum = force.col(s).reshaped(3, force.rows() / 3).rowwise().sum();
    moment.col(s) = world.turn * moment.col(s).eval() + shift.cross(world.turn * sum);
  }
}

Motion written_out(const Motion& motion, double duration_s) {
  const auto frames = static_cast<Eigen::Index>(std::floor(duration_s * motion.rate_hz + 1e-6)) + 1;
  if (!motion.loop) return motion;
  Motion result;
  result.rate_hz = motion.rate_hz;
  result.frames.resize(motion.frames.rows(), frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    result.at(f) = after_cycles(motion, f / motion.count()) * motion.at(f % motion.count());
  }
  return result;
}

}  // namespace

Motion in_world(const World& world, const Motion& motion, double duration_s) {
  if (!world.is_turned()) return motion;
  Motion result = written_out(motion, duration_s);
  turn_all(world.turn, result.frames);
  move_all(shift_of(world), result.frames);
  return result;
}

Trace in_world(const World& world, const Trace& trace) {
  if (!world.is_turned()) return trace;
  Trace result = trace;
  turn_moments(world, trace.contact_force, result.contact_moment);
  turn_moments(world, trace.effect_force, result.effect_moment);
  for (Eigen::MatrixXd* course : {&result.position, &result.velocity, &result.contact_force, &result.effect_force,
                                  &result.correction_impulse}) {
    turn_all(world.turn, *course);
  }
  move_all(shift_of(world), result.position);
  return result;
}

Motion travel_of(const std::vector<MoveOf<3>>& moves, int obstacle, double rate_hz, Eigen::Index frames) {
  Motion travel;
  travel.rate_hz = rate_hz;
  travel.frames.setZero(3, frames);
  for (const MoveOf<3>& move : moves) {
    if (move.obstacle != obstacle) continue;
    for (Eigen::Index f = 0; f < frames; ++f) {
      const double seconds = std::min(static_cast<double>(f) / rate_hz, move.until_s) - move.from_s;
      if (seconds > 0) travel.frames.col(f) += seconds * move.velocity;
    }
  }
  return travel;
}

}  // namespace hydrostat::retarget

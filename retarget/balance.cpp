#include "retarget/balance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/body.h"
#include "retarget/least_squares.h"

namespace hydrostat::retarget {
namespace {

constexpr double kBalanceWeight = 60;                    // W: per mg of missing force
constexpr double kShiftWeight = 1;                       // per L of shift of the COM, per radian of the trunk
constexpr double kBendWeight = 2;                        // per L (radian) of third difference, at 60 Hz
constexpr double kContactForceWeight = 0.1;              // per mg of contact force, in the midst of a stance
constexpr double kForceAloneWeight = 0.3;                // where the forces alone are sought: makes their split unique
constexpr double kEdgeForceWeight[] = {0.4, 0.2, 0.13};  // in its first and last frames: loads come and go gently

/// Momentum of a motion, frame by frame.
struct Centroidal {
  Eigen::MatrixXd com, acceleration;  // 3 x F
  Eigen::MatrixXd spin_rate;          // 3 x F, rate of the angular momentum about the COM [N m]
  std::vector<Eigen::Matrix3d> inertia;
};

Centroidal centroidal(const Motion& motion, const physics::Body& body, RestingEnds ends) {
  const Eigen::Index frames = motion.count();
  const Eigen::MatrixXd acceleration = accelerations(motion, ends);
  const Eigen::VectorXd& mass = body.mass;
  Centroidal result;
  result.com.resize(3, frames);
  result.acceleration.resize(3, frames);
  result.spin_rate.resize(3, frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const Eigen::Map<const Eigen::Matrix3Xd> a(acceleration.data() + f * acceleration.rows(), 3, mass.size());
    const Eigen::Vector3d c = motion.at(f) * mass / mass.sum();
    const Eigen::Vector3d c_acceleration = a * mass / mass.sum();
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < mass.size(); ++i) {
      const Eigen::Vector3d arm = motion.at(f).col(i) - c, push = mass[i] * (a.col(i) - c_acceleration);
      rate += arm.cross(push);
    }
    result.com.col(f) = c;
    result.acceleration.col(f) = c_acceleration;
    result.spin_rate.col(f) = rate;
    result.inertia.push_back(physics::inertia(body, motion.at(f), c));
  }
  return result;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// The outermost of a frame's generators: per patch the points that lie furthest in eight directions.
std::vector<ContactGenerator> outer_generators(const std::vector<ContactGenerator>& all, const ContactSchedule& contacts,
                                               const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  std::vector<bool> keep(static_cast<std::size_t>(points.cols()), false), present = keep;
  for (const ContactGenerator& g : all) present[static_cast<std::size_t>(g.point)] = true;
  for (const Patch& patch : contacts.patches) {
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d direction(std::cos(M_PI * k / 4), 0, std::sin(M_PI * k / 4));
      int best = -1;
      for (const int p : patch.points) {
        if (!present[static_cast<std::size_t>(p)]) continue;
        if (best < 0 || direction.dot(points.col(p) - points.col(best)) > 1e-12) best = p;
      }
      if (best >= 0) keep[static_cast<std::size_t>(best)] = true;
    }
  }
  std::vector<ContactGenerator> result;
  for (const ContactGenerator& g : all) {
    if (keep[static_cast<std::size_t>(g.point)]) result.push_back(g);
  }
  return result;
}

/// How many frames lie between frame f and the beginning or end of the stance of a point's patch, 3 at most.
int frames_from_edge(const ContactSchedule& contacts, int point, long f, bool loop) {
  const long frames = contacts.touching.cols();
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    if (!std::binary_search(contacts.patches[k].points.begin(), contacts.patches[k].points.end(), point)) continue;
    for (int d = 1; d <= 3; ++d) {
      for (const long g : {f - d, f + d}) {
        if (!loop && (g < 0 || g >= frames)) continue;
        if (contacts.state[k][static_cast<std::size_t>((g + frames) % frames)] == ContactState::kOff) return d - 1;
      }
    }
  }
  return 3;
}

bool rests_beyond(long f, RestingEnds ends) { return f < 0 ? ends.first : ends.last; }

/// The stencil's sum over the path of the COM (3 x F) of a motion around frame f; odd reflection at the moving ends of what is no loop.
Eigen::Vector3d jerk_of(const Eigen::MatrixXd& com, const Motion& motion, RestingEnds ends, long f, const std::vector<double>& stencil) {
  const long frames = motion.count(), reach = static_cast<long>(stencil.size()) / 2;
  const auto place = [&](long g) -> Eigen::Vector3d {
    const long cycle = g < 0 ? -1 : (g >= frames ? 1 : 0);
    if (motion.loop) return after_cycles(motion, cycle) * Eigen::Vector3d(com.col(g - cycle * frames));
    const long inside = std::clamp(g, 0L, frames - 1);
    if (inside == g || rests_beyond(g, ends)) return com.col(inside);
    return 2 * com.col(inside) - com.col(std::clamp(2 * inside - g, 0L, frames - 1));
  };
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (long k = 0; k < static_cast<long>(stencil.size()); ++k) sum += stencil[static_cast<std::size_t>(k)] * place(f + k - reach);
  return sum;
}

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// What one frame wants of contact, and what contact can give.
struct FrameBalance {
  std::vector<ContactGenerator> generators;
  Eigen::Matrix<double, 6, Eigen::Dynamic> give;  // per unit of a generator, in weights: force / (m g), moment about the COM / (m g L)
  Vector6d want;                                  // likewise
};

std::vector<FrameBalance> frame_balances(const Motion& target, const Centroidal& now, const physics::Scene& scene,
                                         const ContactSchedule& contacts, double length, double support_friction) {
  const Motion points = point_motion(scene.contact_points, target);
  const double g = scene.gravity.norm(), weight = scene.body.mass.sum() * g;
  std::vector<FrameBalance> balances;
  for (long f = 0; f < target.count(); ++f) {
    FrameBalance frame;
    frame.generators = outer_generators(contact_generators(contacts, f, scene.ground.friction, support_friction), contacts, points.at(f));
    frame.give.resize(6, static_cast<Eigen::Index>(frame.generators.size()));
    for (std::size_t k = 0; k < frame.generators.size(); ++k) {
      const ContactGenerator& generator = frame.generators[k];
      const Eigen::Vector3d arm = points.at(f).col(generator.point) - now.com.col(f);
      frame.give.col(static_cast<Eigen::Index>(k)) << generator.force, arm.cross(generator.force) / length;
    }
    frame.want << (now.acceleration.col(f) - scene.gravity) / g, now.spin_rate.col(f) / (weight * length);
    balances.push_back(frame);
  }
  return balances;
}

/// The rows of the problem for shift, turn and forces, as they are put together.
class Rows {
 public:
  Rows(const Motion& target, RestingEnds ends, BoundedLeastSquares& problem) : target_(target), ends_(ends), problem_(problem) {}

  long next() const { return row_; }
  void add(long row, long column, double value) { entries_.emplace_back(row, column, value); }

  /// Adds `block` times the move (unknown 0) or turn (3) of frame f, which may lie outside the clip.
  void add_block(long row, long f, int unknown, const Eigen::Matrix3d& block) {
    Eigen::Matrix3d seen = block;
    const long frames = target_.count();
    if (target_.loop) {
      const long cycle = f < 0 ? -1 : (f >= frames ? 1 : 0);
      if (cycle != 0) seen = block * after_cycles(target_, cycle).linear();
      f -= cycle * frames;
    }
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        if (seen(r, c) != 0) add(row + r, 6 * f + unknown + c, seen(r, c));
      }
    }
  }

  void add_stencil(long row, long f, int unknown, const Eigen::Matrix3d& block, const std::vector<double>& stencil) {
    const long frames = target_.count(), reach = static_cast<long>(stencil.size()) / 2;
    for (long k = 0; k < static_cast<long>(stencil.size()); ++k) {
      const double share = stencil[static_cast<std::size_t>(k)];
      const long g = f + k - reach;
      if (share == 0) continue;
      if (!target_.loop && (g < 0 || g >= frames) && !rests_beyond(g, ends_)) {
        // odd reflection: d(-k) = 2 d(0) - d(k)
        const long end = g < 0 ? 0 : frames - 1;
        add_block(row, end, unknown, 2 * share * block);
        add_block(row, std::clamp(2 * end - g, 0L, frames - 1), unknown, -share * block);
      } else {
        add_block(row, target_.loop ? g : std::clamp(g, 0L, frames - 1), unknown, share * block);
      }
    }
  }

  void end_block(const Eigen::VectorXd& target) {
    problem_.row_blocks.push_back(static_cast<int>(row_));
    targets_.insert(targets_.end(), target.data(), target.data() + target.size());
    row_ += target.size();
  }

  void finish(long columns) {
    problem_.row_blocks.push_back(static_cast<int>(row_));
    problem_.jacobian.resize(row_, columns);
    problem_.jacobian.setFromTriplets(entries_.begin(), entries_.end());
    problem_.target = Eigen::Map<Eigen::VectorXd>(targets_.data(), row_);
  }

 private:
  const Motion& target_;
  const RestingEnds ends_;
  BoundedLeastSquares& problem_;
  std::vector<Eigen::Triplet<double>> entries_;
  std::vector<double> targets_;
  long row_ = 0;
};

/// Unknowns: 6 per frame (move, turn), then the forces in weights, frame after frame, not negative.
BoundedLeastSquares shift_problem(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts,
                                  const Centroidal& now, const std::vector<FrameBalance>& balances, double length,
                                  const ShiftCosts& costs, const Shift& so_far, RestingEnds ends) {
  const long frames = target.count();
  const double rate_squared = target.rate_hz * target.rate_hz, g = scene.gravity.norm(), w = kBalanceWeight;
  const double weight = scene.body.mass.sum() * g, place = costs.shift * kShiftWeight, bend = kBendWeight * std::pow(target.rate_hz / 60, 3);
  const std::vector<double> second = {1, -2, 1}, third = {-0.5, 1, 0, -1, 0.5};
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  BoundedLeastSquares problem;
  for (long c = 0; c <= 6 * frames; c += 3) problem.column_blocks.push_back(static_cast<int>(c));
  Rows rows(target, ends, problem);
  std::vector<long> shift_rows;  // the first of each frame's twelve that cost shift and turn
  long column = 6 * frames;
  for (long f = 0; f < frames; ++f) {
    const FrameBalance& frame = balances[static_cast<std::size_t>(f)];
    const long row = rows.next(), forces = frame.give.cols();
    rows.add_stencil(row, f, 0, w / g * rate_squared * identity, second);
    rows.add_stencil(row + 3, f, 3, w / (weight * length) * rate_squared * now.inertia[static_cast<std::size_t>(f)], second);
    rows.add_block(row + 3, f, 0, -w / length * cross_matrix(frame.want.head<3>()));
    for (long k = 0; k < forces; ++k) {
      for (int r = 0; r < 6; ++r) rows.add(row + r, column + k, -w * frame.give(r, k));
    }
    rows.end_block(-w * frame.want);
    for (long k = 0; k < forces; ++k) {
      const int age = frames_from_edge(contacts, frame.generators[static_cast<std::size_t>(k)].point, f, target.loop);
      rows.add(rows.next(), column + k, costs.forces * (age < 3 ? kEdgeForceWeight[age] : kContactForceWeight));
      rows.end_block(Eigen::VectorXd::Zero(1));
      problem.column_blocks.push_back(static_cast<int>(column + k + 1));
    }
    column += forces;
    const long still = rows.next();
    shift_rows.push_back(still);
    rows.add_block(still, f, 0, place / length * identity);
    rows.add_block(still + 3, f, 3, place * identity);
    rows.add_stencil(still + 6, f, 0, costs.shift * bend / length * identity, third);
    rows.add_stencil(still + 9, f, 3, costs.shift * bend * identity, third);
    if (costs.jerk > 0) rows.add_stencil(still + 12, f, 0, costs.jerk * bend / length * identity, third);
    Eigen::VectorXd wanted = Eigen::VectorXd::Zero(costs.jerk > 0 ? 15 : 12);
    if (costs.jerk > 0) wanted.tail<3>() = -costs.jerk * bend / length * jerk_of(now.com, target, ends, f, third);
    rows.end_block(wanted);
  }
  rows.finish(column);
  if (so_far.move.cols() > 0) {
    Eigen::VectorXd before = Eigen::VectorXd::Zero(column);
    before.head(6 * frames).reshaped(6, frames) << so_far.move, so_far.turn;
    const Eigen::VectorXd cost = problem.jacobian * before;
    for (const long row : shift_rows) problem.target.segment<12>(row) -= cost.segment<12>(row);
  }
  problem.lower = Eigen::VectorXd::Constant(column, -std::numeric_limits<double>::infinity());
  problem.upper = -problem.lower;
  problem.lower.tail(column - 6 * frames).setZero();
  return problem;
}

double rms(const Eigen::MatrixXd& columns) { return std::sqrt(columns.squaredNorm() / static_cast<double>(columns.cols())); }

}  // namespace

std::vector<ContactGenerator> contact_generators(const ContactSchedule& contacts, Eigen::Index frame, double friction,
                                                 double support_friction) {
  std::vector<ContactGenerator> generators;
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    const ContactState state = contacts.state[k][static_cast<std::size_t>(frame)];
    if (state == ContactState::kOff) continue;
    for (const int p : contacts.patches[k].points) {
      if (!contacts.touching(p, frame)) continue;
      // The share of friction that sliding settles points against the motion; the rest is free to any side.
      const Eigen::Vector2d settled(contacts.sliding_x(static_cast<Eigen::Index>(k), frame), contacts.sliding_z(static_cast<Eigen::Index>(k), frame));
      const Eigen::Vector2d centre = state == ContactState::kSlide ? Eigen::Vector2d(-friction * settled) : Eigen::Vector2d::Zero();
      const double free = state == ContactState::kSlide ? 1 - settled.norm() : 1, mu = friction * support_friction * free;
      if (free < 1e-9) {
        generators.push_back({p, Eigen::Vector3d(centre.x(), 1, centre.y())});
        continue;
      }
      for (const Eigen::Vector2d& side : {Eigen::Vector2d(mu, 0), Eigen::Vector2d(-mu, 0), Eigen::Vector2d(0, mu), Eigen::Vector2d(0, -mu)}) {
        generators.push_back({p, Eigen::Vector3d(centre.x() + side.x(), 1, centre.y() + side.y())});
      }
    }
  }
  return generators;
}

Shift find_shift(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts, double length,
                 double support_friction, int max_pivots, const ShiftCosts& costs, const Shift& so_far, RestingEnds ends) {
  const Centroidal now = centroidal(target, scene.body, ends);
  const std::vector<FrameBalance> balances = frame_balances(target, now, scene, contacts, length, support_friction);
  const BoundedLeastSquares problem = shift_problem(target, scene, contacts, now, balances, length, costs, so_far, ends);
  const long frames = target.count(), forces = problem.lower.size() - 6 * frames;
  Eigen::VectorXd start = Eigen::VectorXd::Zero(problem.lower.size());
  start.tail(forces).setConstant(1e-3);
  const BoundedSolution solution = solve(problem, start, max_pivots);

  Shift shift;
  shift.converged = solution.converged;
  shift.move.resize(3, frames);
  shift.turn.resize(3, frames);
  Eigen::MatrixXd missing(6, frames);
  const Eigen::VectorXd residual = problem.jacobian * solution.x - problem.target;
  std::size_t block = 0;
  for (long f = 0; f < frames; ++f) {
    shift.move.col(f) = solution.x.segment<3>(6 * f);
    shift.turn.col(f) = solution.x.segment<3>(6 * f + 3);
    missing.col(f) = residual.segment<6>(problem.row_blocks[block]) / kBalanceWeight;
    block += 2 + balances[static_cast<std::size_t>(f)].generators.size();
  }
  shift.badness = rms(missing.topRows<3>()) + rms(missing.bottomRows<3>()) + rms(shift.move) / length;
  return shift;
}

void add(const Shift& shift, Shift& so_far) {
  if (so_far.move.cols() == 0) {
    so_far = shift;
    return;
  }
  so_far.move += shift.move;
  so_far.turn += shift.turn;
}

Motion shifted(const Motion& motion, const Shift& shift, const physics::Body& body) {
  Motion result = motion;
  for (Eigen::Index f = 0; f < motion.count(); ++f) {
    const Eigen::Vector3d c = physics::centre_of_mass(body, motion.at(f));
    const Eigen::Vector3d turn = shift.turn.col(f);
    const Eigen::Matrix3d rotation =
        turn.norm() > 0 ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() : Eigen::Matrix3d::Identity();
    for (Eigen::Index i = 0; i < body.node_count(); ++i) {
      result.at(f).col(i) = c + rotation * (motion.at(f).col(i) - c) + shift.move.col(f);
    }
  }
  return result;
}

Eigen::MatrixXd missing_wrench(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts, double length,
                               double support_friction, RestingEnds ends) {
  const std::vector<FrameBalance> balances =
      frame_balances(target, centroidal(target, scene.body, ends), scene, contacts, length, support_friction);
  Eigen::MatrixXd missing(6, target.count());
  for (long f = 0; f < target.count(); ++f) {
    const FrameBalance& frame = balances[static_cast<std::size_t>(f)];
    const BoundedLeastSquares problem =
        held_nonnegative(kBalanceWeight * frame.give, kBalanceWeight * frame.want, kForceAloneWeight);
    const Eigen::VectorXd given = solve(problem, Eigen::VectorXd::Constant(frame.give.cols(), 1e-3)).x;
    missing.col(f) = frame.want - frame.give * given;
  }
  return missing;
}

void fall_freely(const ContactSchedule& contacts, const physics::Scene& scene, Motion& motion) {
  const long frames = motion.count();
  const Eigen::VectorXd shares = scene.body.mass / scene.body.mass.sum();
  const Eigen::Vector3d step = scene.gravity / (motion.rate_hz * motion.rate_hz);
  const auto flying = [&](long f) { return !contacts.touching.col(((f % frames) + frames) % frames).any(); };
  const auto com = [&](long f) -> Eigen::Vector3d {  // f may lie one period on
    const Eigen::Vector3d c = motion.at(f % frames) * shares;
    return after_cycles(motion, f / frames) * c;
  };
  for (long f = 0; f < frames; ++f) {
    if (flying(f) || !flying(f + 1) || (!motion.loop && f + 1 >= frames)) continue;
    long end = f + 1;
    while (flying(end) && (motion.loop || end < frames)) ++end;
    if (!motion.loop && end >= frames) continue;  // it never lands
    const Eigen::Vector3d from = com(f), to = com(end);
    const double count = static_cast<double>(end - f);
    for (long g = f + 1; g < end; ++g) {
      const double k = static_cast<double>(g - f);
      const Eigen::Vector3d wanted = from + (to - from) * (k / count) + 0.5 * k * (k - count) * step;
      const Eigen::Vector3d move = after_cycles(motion, g / frames).linear().transpose() * (wanted - com(g));
      for (Eigen::Index i = 0; i < shares.size(); ++i) motion.at(g % frames).col(i) += move;
    }
  }
}

}  // namespace hydrostat::retarget

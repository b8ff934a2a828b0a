#include "retarget/prepare.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "physics/elastic_forces.h"
#include "physics/system_matrix.h"
#include "retarget/least_squares.h"

namespace hydrostat::retarget {
namespace {

constexpr double kGravity = 9.81;
constexpr double kEdgeShare = 0.02;      // of the springs, at rest in the animator's shape, that the volume step keeps against folding
constexpr double kTether = 0.2;          // of E / (rho L^2) [1/s2]: pull back to the animator's shape
constexpr double kHold = 1000;           // a contact's pull over a node's tether
constexpr double kBalanceWeight = 60;    // W: per mg of missing force
constexpr double kShiftWeight = 1;       // per L of shift of the COM, per radian of the trunk
constexpr double kBendWeight = 2;        // per L (radian) of third difference, at 60 Hz
constexpr double kForceWeight = 0.1;     // per mg of contact force, in the midst of a stance
constexpr double kForceAloneWeight = 0.3; // where the forces alone are sought: makes their split unique
constexpr double kEdgeForceWeight[] = {0.4, 0.2, 0.13};  // in its first and last frames: loads come and go gently

constexpr double kTouching = 0.003;        // per D: points of a contact that ended higher bear no load
constexpr double kGoodBalance = 0.02;    // badness (missing force per weight + shift per L) that needs no more contacts
constexpr double kWorseBalance = 1.5;    // times the least badness: fewer contacts are preferred up to here

double rms_difference(const Motion& a, const Motion& b, const Eigen::VectorXd& mass) {
  double sum = 0;
  for (Eigen::Index f = 0; f < a.count(); ++f) {
    sum += ((a.at(f) - b.at(f)).colwise().squaredNorm() * mass)(0) / mass.sum();
  }
  return std::sqrt(sum / static_cast<double>(a.count()));
}

/// Where a contact point has to be in one frame.
struct Hold {
  int point;
  Eigen::Vector3d place;
  bool sideways;  // x and z too, not the height alone
};

/// Where patches stand: the mean place of each point over each run of sticking frames.
std::vector<std::vector<Hold>> find_holds(const ContactSchedule& contacts, const Motion& points) {
  const long frames = points.count();
  std::vector<std::vector<Hold>> holds(static_cast<std::size_t>(frames));
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    const auto state = [&](long f) { return contacts.state[k][static_cast<std::size_t>(((f % frames) + frames) % frames)]; };
    for (long f = 0; f < frames; ++f) {
      if (state(f) == ContactState::kSlide) {
        for (const int p : contacts.patches[k].points) {
          if (contacts.touching(p, f)) holds[static_cast<std::size_t>(f)].push_back({p, Eigen::Vector3d::Zero(), false});
        }
      }
    }
    // Runs of sticking; in a loop a run may pass the seam, and then its later part lies one period on.
    long begin = 0;
    if (points.loop) {
      while (begin < frames && state(begin) == ContactState::kStick) ++begin;
    }
    const bool always = begin == frames;
    if (always) begin = 0;
    for (long f = begin; f < begin + frames;) {
      if (f >= frames && !points.loop) break;
      if (state(f) != ContactState::kStick) {
        ++f;
        continue;
      }
      long end = f;
      while (end < begin + frames && (points.loop || end < frames) && state(end) == ContactState::kStick) ++end;
      for (const int p : contacts.patches[k].points) {
        Eigen::Vector3d mean = Eigen::Vector3d::Zero();
        for (long g = f; g < end; ++g) {
          mean += after_cycles(points, g >= frames ? 1 : 0) * Eigen::Vector3d(points.at(g % frames).col(p));
        }
        mean /= static_cast<double>(end - f);
        mean.y() = 0;
        for (long g = f; g < end; ++g) {
          if (!contacts.touching(p, g % frames)) continue;
          const Eigen::Vector3d place = after_cycles(points, g >= frames ? -1 : 0) * mean;
          holds[static_cast<std::size_t>(g % frames)].push_back({p, place, true});
        }
      }
      f = end;
    }
  }
  return holds;
}

/// The nearest shape (mass-weighted) of unit volume ratio in every tet that keeps the holds and stays above the ground.
/// Newton on tether + volume + a little of the springs, as the volume projection of the trials.
class ShapeProjector {
 public:
  ShapeProjector(const physics::Scene& scene, double length, double youngs_over_density)
      : scene_(scene), body_(scene.body), matrix_(scene.body) {
    body_.edge_stiffness *= kEdgeShare;
    tether_ = kTether * youngs_over_density / (length * length);
    // Light limbs are held to their shape as firmly as the trunk.
    body_.mass.setConstant(body_.mass.mean());
    hold_ = kHold * tether_ * body_.mass.mean();
  }

  /// `floor` [m]: the least height of each contact point.
  Eigen::Matrix3Xd project(const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds, const Eigen::VectorXd& floor, bool keep_volume) {
    if (!keep_volume) body_.volume_stiffness.setZero();
    shape_.resize(body_.edge_count());
    for (int e = 0; e < body_.edge_count(); ++e) {
      shape_[e] = (target.col(body_.edges(1, e)) - target.col(body_.edges(0, e))).norm() / body_.rest_length[e];
    }
    Eigen::Matrix3Xd x = target;
    double energy = energy_of(x, target, holds, floor);
    for (int iteration = 0; iteration < 12; ++iteration) {
      Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, x.cols());
      physics::add_elastic_forces(body_, x, shape_, force);
      for (int i = 0; i < x.cols(); ++i) force.col(i) -= tether_ * body_.mass[i] * (x.col(i) - target.col(i));
      matrix_.set_zero();
      matrix_.add_mass(body_, tether_);
      matrix_.add_stiffness(body_, x, shape_, 1);
      for (const Hold& hold : holds) pull(hold.point, error_of(hold, x), hold.sideways, force);
      for (int p = 0; p < scene_.contact_points.count(); ++p) {
        const double height = scene_.contact_points.of(x, p).y() - floor[p];
        if (height < 0) pull(p, Eigen::Vector3d(0, height, 0), false, force);
      }
      if (!matrix_.factor()) break;
      Eigen::MatrixXd step = Eigen::Map<Eigen::VectorXd>(force.data(), force.size());
      matrix_.solve_in_place(step);
      const Eigen::Map<const Eigen::Matrix3Xd> move(step.data(), 3, x.cols());
      double scale = 1;
      for (; scale > 1e-3; scale /= 2) {
        const Eigen::Matrix3Xd trial = x + scale * move;
        const double trial_energy = energy_of(trial, target, holds, floor);
        if (trial_energy < energy) {
          x = trial;
          energy = trial_energy;
          break;
        }
      }
      if (scale <= 1e-3 || step.norm() < 1e-9 * std::sqrt(static_cast<double>(step.size()))) break;
    }
    return x;
  }

 private:
  Eigen::Vector3d error_of(const Hold& hold, const Eigen::Matrix3Xd& x) const {
    Eigen::Vector3d error = scene_.contact_points.of(x, hold.point) - hold.place;
    if (!hold.sideways) error.x() = error.z() = 0;
    return error;
  }
  double energy_of(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds,
                   const Eigen::VectorXd& floor) const {
    double energy = physics::elastic_energy(body_, x, shape_);
    energy += 0.5 * tether_ * ((x - target).colwise().squaredNorm() * body_.mass)(0);
    for (const Hold& hold : holds) energy += 0.5 * hold_ * error_of(hold, x).squaredNorm();
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      const double height = scene_.contact_points.of(x, p).y() - floor[p];
      if (height < 0) energy += 0.5 * hold_ * height * height;
    }
    return energy;
  }
  void pull(int p, const Eigen::Vector3d& error, bool sideways, Eigen::Matrix3Xd& force) {
    const physics::ContactPoints& points = scene_.contact_points;
    for (int k = 0; k < 4; ++k) force.col(points.nodes(k, p)) -= hold_ * points.weights(k, p) * error;
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
    block(1, 1) = hold_;
    if (sideways) block(0, 0) = block(2, 2) = hold_;
    matrix_.add_contact(points, p, block);
  }

  const physics::Scene& scene_;
  physics::Body body_;
  physics::SystemMatrix matrix_;
  Eigen::VectorXd shape_;  // activation for which the animator's shape has no stress
  double tether_ = 0, hold_ = 0;
};

/// Momentum of a motion, frame by frame.
struct Centroidal {
  Eigen::MatrixXd com, acceleration;  // 3 x F
  Eigen::MatrixXd spin_rate;          // 3 x F, rate of the angular momentum about the COM [N m]
  std::vector<Eigen::Matrix3d> inertia;
};

Centroidal centroidal(const Motion& motion, const physics::Body& body) {
  const Eigen::Index frames = motion.count();
  const Eigen::MatrixXd acceleration = accelerations(motion);
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

/// Shift of the COM and turn of the trunk per frame.
struct Shift {
  Eigen::MatrixXd move, turn;      // 3 x F [m], [rad]
  Eigen::MatrixXd missing_wrench;  // 6 x F of what remains
};

/// Solves for shift, turn and contact forces together; with `may_shift` false for the contact forces alone.
Shift balance(const Motion& target, const physics::Scene& scene, const ContactSchedule& contacts, double length,
              double support_friction, bool may_shift, int max_pivots = 60) {
  const long frames = target.count();
  const double weight = scene.body.mass.sum() * kGravity, mass = scene.body.mass.sum();
  const Centroidal now = centroidal(target, scene.body);
  const Motion points = point_motion(scene.contact_points, target);
  const Eigen::Vector3d gravity = scene.gravity;

  std::vector<std::vector<ContactGenerator>> generators;
  const long shift_columns = may_shift ? 6 * frames : 0;
  long columns = shift_columns;
  BoundedLeastSquares problem;
  for (long c = 0; c <= shift_columns; c += 3) problem.column_blocks.push_back(static_cast<int>(c));
  if (!may_shift) problem.column_blocks.assign(1, 0);
  for (long f = 0; f < frames; ++f) {
    generators.push_back(outer_generators(contact_generators(contacts, f, scene.ground.friction, support_friction), contacts, points.at(f)));
    for (std::size_t k = 0; k < generators.back().size(); ++k) problem.column_blocks.push_back(static_cast<int>(++columns));
  }
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<double> target_rows;
  long row = 0;
  const auto end_block = [&](long rows) {
    problem.row_blocks.push_back(static_cast<int>(row));
    row += rows;
  };
  // Adds `block` times the unknown (0: move, 3: turn) of frame f, which may lie outside the clip.
  const auto add_block = [&](long at_row, long f, int unknown, const Eigen::Matrix3d& block) {
    Eigen::Matrix3d seen = block;
    if (target.loop) {
      const long cycle = f < 0 ? -1 : (f >= frames ? 1 : 0);
      if (cycle != 0) seen = block * after_cycles(target, cycle).linear();
      f -= cycle * frames;
    }
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        if (seen(r, c) != 0) entries.emplace_back(at_row + r, 6 * f + unknown + c, seen(r, c));
      }
    }
  };
  const auto add_stencil = [&](long at_row, long f, int unknown, const Eigen::Matrix3d& block, const std::vector<double>& stencil) {
    const long reach = static_cast<long>(stencil.size()) / 2;
    for (long k = 0; k < static_cast<long>(stencil.size()); ++k) {
      if (stencil[static_cast<std::size_t>(k)] == 0) continue;
      long g = f + k - reach;
      if (!target.loop && (g < 0 || g >= frames)) {
        // odd reflection: d(-k) = 2 d(0) - d(k)
        const long end = g < 0 ? 0 : frames - 1;
        add_block(at_row, end, unknown, 2 * stencil[static_cast<std::size_t>(k)] * block);
        add_block(at_row, std::clamp(2 * end - g, 0L, frames - 1), unknown, -stencil[static_cast<std::size_t>(k)] * block);
        continue;
      }
      add_block(at_row, g, unknown, stencil[static_cast<std::size_t>(k)] * block);
    }
  };
  const std::vector<double> second = {1, -2, 1}, third = {-0.5, 1, 0, -1, 0.5};
  const double rate_squared = target.rate_hz * target.rate_hz;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  long alpha_column = shift_columns;
  for (long f = 0; f < frames; ++f) {
    const Eigen::Vector3d c = now.com.col(f), lack = mass * (now.acceleration.col(f) - gravity);
    const double w = kBalanceWeight / weight;
    if (may_shift) {
      add_stencil(row, f, 0, w * mass * rate_squared * identity, second);
      add_stencil(row + 3, f, 3, w / length * rate_squared * now.inertia[static_cast<std::size_t>(f)], second);
      add_block(row + 3, f, 0, -w / length * cross_matrix(lack));
    }
    long column = alpha_column;
    for (const ContactGenerator& g : generators[static_cast<std::size_t>(f)]) {
      const Eigen::Vector3d arm = points.at(f).col(g.point) - c, moment = arm.cross(g.force) / length;
      for (int r = 0; r < 3; ++r) {
        // the unknown force is counted in weights
        entries.emplace_back(row + r, column, -w * weight * g.force[r]);
        entries.emplace_back(row + 3 + r, column, -w * weight * moment[r]);
      }
      ++column;
    }
    for (int r = 0; r < 3; ++r) target_rows.push_back(-w * lack[r]);
    for (int r = 0; r < 3; ++r) target_rows.push_back(-w / length * now.spin_rate(r, f));
    end_block(6);
    for (long k = alpha_column; k < column; ++k) {
      const int point = generators[static_cast<std::size_t>(f)][static_cast<std::size_t>(k - alpha_column)].point;
      const int age = std::min<int>(frames_from_edge(contacts, point, f, target.loop), 3);
      entries.emplace_back(row, k, !may_shift ? kForceAloneWeight : age < 3 ? kEdgeForceWeight[age] : kForceWeight);
      target_rows.push_back(0);
      end_block(1);
    }
    alpha_column = column;
    if (!may_shift) continue;
    const double bend = kBendWeight * std::pow(target.rate_hz / 60, 3);
    add_block(row, f, 0, kShiftWeight / length * identity);
    add_block(row + 3, f, 3, kShiftWeight * identity);
    add_stencil(row + 6, f, 0, bend / length * identity, third);
    add_stencil(row + 9, f, 3, bend * identity, third);
    target_rows.insert(target_rows.end(), 12, 0.0);
    end_block(12);
  }
  problem.row_blocks.push_back(static_cast<int>(row));
  problem.jacobian.resize(row, columns);
  problem.jacobian.setFromTriplets(entries.begin(), entries.end());
  problem.target = Eigen::Map<Eigen::VectorXd>(target_rows.data(), row);
  problem.lower = Eigen::VectorXd::Constant(columns, -std::numeric_limits<double>::infinity());
  problem.upper = Eigen::VectorXd::Constant(columns, std::numeric_limits<double>::infinity());
  problem.lower.tail(columns - shift_columns).setZero();
  Eigen::VectorXd start = Eigen::VectorXd::Zero(columns);
  start.tail(columns - shift_columns).setConstant(1e-3);
  const BoundedSolution solution = solve(problem, start, max_pivots);

  Shift shift;
  shift.move = shift.turn = Eigen::MatrixXd::Zero(3, frames);
  shift.missing_wrench.resize(6, frames);
  const Eigen::VectorXd residual = problem.jacobian * solution.x - problem.target;
  long block = 0;
  for (long f = 0; f < frames; ++f) {
    if (may_shift) {
      shift.move.col(f) = solution.x.segment<3>(6 * f);
      shift.turn.col(f) = solution.x.segment<3>(6 * f + 3);
    }
    shift.missing_wrench.col(f) = residual.segment<6>(problem.row_blocks[static_cast<std::size_t>(block)]) / kBalanceWeight;
    block += 1 + static_cast<long>(generators[static_cast<std::size_t>(f)].size()) + (may_shift ? 1 : 0);
  }
  return shift;
}

/// Labels at the smallest of a few heights that lets the body stand: what hovers a little higher was meant to bear weight where
/// the clip cannot be balanced without it (a worm's dragged end). Badness counts missing force per weight and shift per L.
ContactSchedule choose_contacts(const Motion& grounded, const Motion& points, const physics::Scene& scene, const std::vector<int>& patch_bone,
                                const std::vector<std::string>& bone_names, double length, double size, const PrepareOptions& options) {
  std::vector<ContactSchedule> schedules;
  std::vector<double> badness;
  for (const double factor : {1.0, 2.0, 3.5, 5.0}) {
    ContactOptions contact_options = options.contacts;
    contact_options.height *= factor;
    schedules.push_back(label_contacts(points, patch_bone, bone_names, length, size, contact_options));
    const Shift shift = balance(grounded, scene, schedules.back(), length, options.support_friction, true, 12);
    const double frames = static_cast<double>(grounded.count());
    badness.push_back(std::sqrt(shift.missing_wrench.topRows<3>().squaredNorm() / frames) +
                      std::sqrt(shift.missing_wrench.bottomRows<3>().squaredNorm() / frames) +
                      std::sqrt(shift.move.squaredNorm() / frames) / length);
    if (badness.back() < kGoodBalance) break;
  }
  const double least = *std::min_element(badness.begin(), badness.end());
  std::size_t chosen = 0;
  while (badness[chosen] > std::max(kGoodBalance, kWorseBalance * least)) ++chosen;
  return schedules[chosen];
}

/// Node by node, how far it follows a move of the trunk: nodes near holding patches stay.
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

/// Least heights of the contact points over the frames [m], P x F: 0 in contact, `clearance` away from it, fading between.
Eigen::MatrixXd floors(const ContactSchedule& contacts, bool loop, double clearance, int fade) {
  const long frames = contacts.touching.cols();
  Eigen::MatrixXd floor = Eigen::MatrixXd::Zero(contacts.touching.rows(), frames);
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    for (long f = 0; f < frames; ++f) {
      long away = fade;
      for (long d = -fade; d <= fade; ++d) {
        long g = f + d;
        if (loop) g = ((g % frames) + frames) % frames;
        if (g < 0 || g >= frames) continue;
        if (contacts.state[k][static_cast<std::size_t>(g)] != ContactState::kOff) away = std::min(away, std::labs(d));
      }
      const double share = static_cast<double>(away) / fade;
      for (const int p : contacts.patches[k].points) floor(p, f) = clearance * share * share;
    }
  }
  return floor;
}

/// Projects all frames, twice with what the projection changed smoothed over time, then once more so that contacts hold.
Motion project_frames(const Motion& motion, const std::vector<std::vector<Hold>>& holds, const Eigen::MatrixXd& floor,
                      ShapeProjector& projector, bool keep_volume, double smooth_hz) {
  Motion result = motion;
  for (int pass = 0; pass < 3; ++pass) {
    Motion change = motion;
    for (Eigen::Index f = 0; f < motion.count(); ++f) {
      const Eigen::Matrix3Xd shape = projector.project(result.at(f), holds[static_cast<std::size_t>(f)], floor.col(f), keep_volume);
      change.at(f) = shape - motion.at(f);
    }
    change.travel.setZero();  // the change alone is smoothed; it does not travel with the loop
    result.frames = motion.frames + (pass < 2 ? smooth(change, smooth_hz) : change).frames;
  }
  return result;
}

/// Moves every frame of a flight as a whole so that the COM falls freely between the last and the first frame in contact.
/// A rigid move leaves volume and shape as they are, and in flight no foot holds it back.
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

}  // namespace

Motion smooth(const Motion& motion, double cutoff_hz) {
  const int pad = static_cast<int>(std::ceil(3 * motion.rate_hz / cutoff_hz)) + 6;
  const Eigen::MatrixXd padded = padded_frames(motion, pad);
  const int n = static_cast<int>(padded.cols());
  const double penalty = std::pow(2 * std::sin(M_PI * std::min(0.49, cutoff_hz / motion.rate_hz)), -6);
  Eigen::SparseMatrix<double> difference(n - 3, n);
  std::vector<Eigen::Triplet<double>> entries;
  for (int r = 0; r < n - 3; ++r) {
    const double stencil[4] = {-1, 3, -3, 1};
    for (int k = 0; k < 4; ++k) entries.emplace_back(r, r + k, stencil[k]);
  }
  difference.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseMatrix<double> matrix = penalty * Eigen::SparseMatrix<double>(difference.transpose() * difference);
  for (int i = 0; i < n; ++i) matrix.coeffRef(i, i) += 1;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  const Eigen::MatrixXd smoothed = factor.solve(padded.transpose());
  Motion result = motion;
  result.frames = smoothed.transpose().middleCols(pad, motion.count());
  return result;
}

std::vector<ContactGenerator> contact_generators(const ContactSchedule& contacts, Eigen::Index frame, double friction,
                                                 double support_friction) {
  std::vector<ContactGenerator> generators;
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    const ContactState state = contacts.state[k][static_cast<std::size_t>(frame)];
    if (state == ContactState::kOff) continue;
    for (const int p : contacts.patches[k].points) {
      if (!contacts.touching(p, frame)) continue;
      if (state == ContactState::kSlide) {
        const double x = contacts.sliding_x(static_cast<Eigen::Index>(k), frame), z = contacts.sliding_z(static_cast<Eigen::Index>(k), frame);
        generators.push_back({p, Eigen::Vector3d(-friction * x, 1, -friction * z)});
      } else {
        const double mu = friction * support_friction;
        for (const Eigen::Vector2d& side : {Eigen::Vector2d(mu, 0), Eigen::Vector2d(-mu, 0), Eigen::Vector2d(0, mu), Eigen::Vector2d(0, -mu)}) {
          generators.push_back({p, Eigen::Vector3d(side.x(), 1, side.y())});
        }
      }
    }
  }
  return generators;
}

PreparedTarget prepare(const Motion& coupled, const physics::Scene& scene, const std::vector<int>& patch_bone,
                       const std::vector<std::string>& bone_names, const Eigen::MatrixXd& node_bone_weights, double length,
                       double size, const PrepareOptions& options) {
  const physics::Body& body = scene.body;
  PreparedTarget result;
  PreparationReport& report = result.report;
  Motion target = smooth(coupled, options.smooth_hz);
  report.smooth_shift_rms_length = rms_difference(target, coupled, body.mass) / length;

  Motion points = point_motion(scene.contact_points, coupled);
  const double ground = ground_height(points);
  for (Eigen::Index r = 1; r < target.frames.rows(); r += 3) target.frames.row(r).array() -= ground;
  for (Eigen::Index r = 1; r < points.frames.rows(); r += 3) points.frames.row(r).array() -= ground;
  const Motion grounded = target;
  result.contacts = choose_contacts(target, points, scene, patch_bone, bone_names, length, size, options);
  const std::vector<std::vector<Hold>> holds = find_holds(result.contacts, points);
  const Eigen::MatrixXd floor = floors(result.contacts, target.loop, options.clearance * size, options.clearance_frames);
  points = point_motion(scene.contact_points, target);

  // The foot lock's offset of each patch moves its bone's nodes and fades out over the frames around the contact.
  std::map<std::string, Eigen::Index> bone_index;
  for (std::size_t b = 0; b < bone_names.size(); ++b) bone_index[bone_names[b]] = static_cast<Eigen::Index>(b);
  const long frames = target.count();
  for (const Patch& patch : result.contacts.patches) {
    Motion offset;
    offset.rate_hz = target.rate_hz;
    offset.loop = target.loop;
    offset.yaw = target.yaw;
    offset.frames = Eigen::MatrixXd::Zero(3, frames);
    for (long f = 0; f < frames; ++f) {
      int count = 0;
      for (const Hold& hold : holds[static_cast<std::size_t>(f)]) {
        if (!std::binary_search(patch.points.begin(), patch.points.end(), hold.point)) continue;
        Eigen::Vector3d error = hold.place - points.at(f).col(hold.point);
        if (!hold.sideways) error.x() = error.z() = 0;
        offset.frames.col(f) += error;
        ++count;
      }
      if (count > 0) offset.frames.col(f) /= count;
      if (count == 0) {
        for (const int p : patch.points) offset.frames(1, f) = std::max(offset.frames(1, f), floor(p, f) - points.at(f)(1, p));
      }
    }
    offset = smooth(offset, options.smooth_hz);
    const Eigen::Index bone = bone_index.at(patch.name);
    for (long f = 0; f < frames; ++f) {
      for (int i = 0; i < body.node_count(); ++i) target.at(f).col(i) += node_bone_weights(bone, i) * offset.frames.col(f);
    }
  }
  report.foot_shift_rms_length = rms_difference(target, grounded, body.mass) / length;

  const double youngs_over_density = length * kGravity / 0.005;
  ShapeProjector projector(scene, length, youngs_over_density);
  const Motion locked = target;
  target = project_frames(locked, holds, floor, projector, options.volume, options.smooth_hz);
  report.volume_shift_rms_length = rms_difference(target, locked, body.mass) / length;
  const auto remark = [&] { mark_touching(point_motion(scene.contact_points, target), kTouching * size, result.contacts); };
  remark();
  const Motion before_momentum = target;
  if (options.momentum) {
    Motion wanted = locked;  // the animator's shape with the shifts so far
    for (int round = 0; round < options.rounds; ++round) {
      const Shift shift = balance(target, scene, result.contacts, length, options.support_friction, true);
      wanted = shifted(wanted, shift, body);
      target = project_frames(wanted, holds, floor, projector, options.volume, options.smooth_hz);
      fall_freely(result.contacts, scene, target);
      remark();
    }
  }
  report.momentum_shift_rms_length = rms_difference(target, before_momentum, body.mass) / length;
  report.total_shift_rms_length = rms_difference(target, grounded, body.mass) / length;
  result.missing_wrench = balance(target, scene, result.contacts, length, options.support_friction, false).missing_wrench;
  double squared = 0;
  for (long f = 0; f < frames; ++f) {
    const double missing = result.missing_wrench.col(f).head<3>().norm();
    squared += missing * missing / static_cast<double>(frames);
    report.missing_wrench_max_mg = std::max(report.missing_wrench_max_mg, missing);
  }
  report.missing_wrench_rms_mg = std::sqrt(squared);
  report.flight_s = result.contacts.flight_s(target.rate_hz);
  report.min_jacobian = std::numeric_limits<double>::infinity();
  double volume_squared = 0;
  for (long f = 0; f < frames; ++f) {
    const Eigen::VectorXd jacobian = physics::jacobians(body, target.at(f));
    report.min_jacobian = std::min(report.min_jacobian, jacobian.minCoeff());
    volume_squared += (jacobian.array() - 1).square().mean() / static_cast<double>(frames);
  }
  report.volume_error_rms = std::sqrt(volume_squared);
  result.target = target;
  return result;
}

}  // namespace hydrostat::retarget

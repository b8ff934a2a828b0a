#include "retarget/shape_projection.h"

#include <algorithm>
#include <cmath>

#include "physics/elastic_forces.h"
#include "retarget/smooth.h"

namespace hydrostat::retarget {
namespace {

constexpr double kEdgeShare = 0.02;   // of the springs, at rest in the animator's shape, that keeps the volume step from folding
constexpr double kReachShare = 0.1;   // where the animator's shape is beyond reach, that holds it back
constexpr double kTether = 40;        // of g / L [1/s2]: pull back to the animator's shape
constexpr double kHold = 1000;        // a contact's pull over a node's tether

/// A run of sticking frames of one patch [begin, end); in a loop it may pass the seam, its later part then lies one period on.
struct Stance {
  long begin, end;
};

std::vector<Stance> stances_of(const std::vector<ContactState>& states, bool loop) {
  const long frames = static_cast<long>(states.size());
  const auto state = [&](long f) { return states[static_cast<std::size_t>(((f % frames) + frames) % frames)]; };
  long first = 0;
  if (loop) {
    while (first < frames && state(first) == ContactState::kStick) ++first;
    if (first == frames) first = 0;  // it never ceases to stand
  }
  const long last = loop ? first + frames : frames;
  std::vector<Stance> stances;
  for (long f = first; f < last; ++f) {
    if (state(f) != ContactState::kStick) continue;
    long end = f;
    while (end < last && state(end) == ContactState::kStick) ++end;
    stances.push_back({f, end});
    f = end;
  }
  return stances;
}

}  // namespace

std::vector<std::vector<Hold>> find_holds(const ContactSchedule& contacts, const Motion& points) {
  const long frames = points.count();
  std::vector<std::vector<Hold>> holds(static_cast<std::size_t>(frames));
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    for (long f = 0; f < frames; ++f) {
      if (contacts.state[k][static_cast<std::size_t>(f)] != ContactState::kSlide) continue;
      for (const int p : contacts.patches[k].points) {
        if (contacts.touching(p, f)) holds[static_cast<std::size_t>(f)].push_back({p, Eigen::Vector3d::Zero(), false});
      }
    }
    for (const Stance& stance : stances_of(contacts.state[k], points.loop)) {
      for (const int p : contacts.patches[k].points) {
        Eigen::Vector3d mean = Eigen::Vector3d::Zero();
        for (long f = stance.begin; f < stance.end; ++f) {
          mean += after_cycles(points, f >= frames ? 1 : 0) * Eigen::Vector3d(points.at(f % frames).col(p));
        }
        mean /= static_cast<double>(stance.end - stance.begin);
        mean.y() = 0;
        for (long f = stance.begin; f < stance.end; ++f) {
          if (!contacts.touching(p, f % frames)) continue;
          const Eigen::Vector3d place = after_cycles(points, f >= frames ? -1 : 0) * mean;
          holds[static_cast<std::size_t>(f % frames)].push_back({p, place, true});
        }
      }
    }
  }
  return holds;
}

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

ShapeProjector::ShapeProjector(const physics::Scene& scene, double length, bool keep_volume, double firmness)
    : scene_(scene), body_(scene.body), matrix_(scene.body) {
  if (!keep_volume) body_.volume_stiffness.setZero();
  tether_ = firmness * kTether * scene.gravity.norm() / length;
  // Light limbs are held to their shape as firmly as the trunk.
  body_.mass.setConstant(body_.mass.mean());
  hold_ = kHold * tether_ * body_.mass.mean();
}

Eigen::Matrix3Xd ShapeProjector::project(const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds, const Eigen::VectorXd& floor, double reach) {
  shape_.resize(body_.edge_count());
  for (int e = 0; e < body_.edge_count(); ++e) {
    const double wanted = (target.col(body_.edges(1, e)) - target.col(body_.edges(0, e))).norm() / body_.rest_length[e];
    shape_[e] = std::clamp(wanted, 1 - reach, 1 + reach);
    body_.edge_stiffness[e] = (shape_[e] == wanted ? kEdgeShare : kReachShare) * scene_.body.edge_stiffness[e];
  }
  Eigen::Matrix3Xd x = target;
  double energy = energy_of(x, target, holds, floor);
  Eigen::MatrixXd step;
  for (int iteration = 0; iteration < 12; ++iteration) {
    if (!find_step(x, target, holds, floor, step)) break;
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

bool ShapeProjector::find_step(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds,
                               const Eigen::VectorXd& floor, Eigen::MatrixXd& step) {
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
  if (!matrix_.factor()) return false;
  step = Eigen::Map<Eigen::VectorXd>(force.data(), force.size());
  matrix_.solve_in_place(step);
  return true;
}

Eigen::Vector3d ShapeProjector::error_of(const Hold& hold, const Eigen::Matrix3Xd& x) const {
  const Eigen::Vector3d error = scene_.contact_points.of(x, hold.point) - hold.place;
  return hold.sideways ? error : Eigen::Vector3d(0, error.y(), 0);
}

double ShapeProjector::energy_of(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& target, const std::vector<Hold>& holds,
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

void ShapeProjector::pull(int p, const Eigen::Vector3d& error, bool sideways, Eigen::Matrix3Xd& force) {
  const physics::ContactPoints& points = scene_.contact_points;
  const Eigen::Vector3d stiffness = hold_ * Eigen::Vector3d(sideways, 1, sideways);
  for (int k = 0; k < 4; ++k) force.col(points.nodes(k, p)) -= points.weights(k, p) * stiffness.cwiseProduct(error);
  matrix_.add_contact(points, p, stiffness.asDiagonal());
}

Motion project_frames(const Motion& motion, const std::vector<std::vector<Hold>>& holds, const Eigen::MatrixXd& floor,
                      const Eigen::VectorXd& reach, ShapeProjector& projector, double smooth_hz) {
  Motion result = motion;
  for (int pass = 0; pass < 3; ++pass) {
    Motion change = motion;
    for (Eigen::Index f = 0; f < motion.count(); ++f) {
      const Eigen::Matrix3Xd shape = projector.project(result.at(f), holds[static_cast<std::size_t>(f)], floor.col(f), reach[f]);
      change.at(f) = shape - motion.at(f);
    }
    change.travel.setZero();  // the change alone is smoothed; it does not travel with the loop
    result.frames = motion.frames + (pass < 2 ? smooth(change, smooth_hz) : change).frames;
  }
  return result;
}

}  // namespace hydrostat::retarget

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/elastic_forces.h"
#include "physics/stepper.h"
#include "physics/system_matrix.h"

namespace hydrostat::physics {
namespace {

constexpr double kSinkage = 0.0005;          // of the body's size [-]: how deep one point sinks that bears the whole weight
constexpr double kWeightOfNoGravity = 9.81;  // [m/s2] takes gravity's place in the contact stiffness where there is none
constexpr int kNewtonSteps = 50;             // three or four are the rule
constexpr int kFreeUpdates =
    12;  // of the normal force behind Coulomb's limit; then by halves, for the two might go round for ever
// A node's residual force is told as the velocity that it would give the node in a step, over the body's size [1/s].
constexpr double kResidual = 1e-4;      // small enough
constexpr double kInnerDecrease = 0.3;  // of the residual [-] between two updates of the friction limits
constexpr double kGivenUp = 1e-2;       // after the last iterate: no solution was found
constexpr double kArmijo = 1e-4;
constexpr int kHalvings = 20;
constexpr double kRounding = 1e-12;  // of the potential [-]: a smaller decrease is none

/// Backward Euler as the minimum of an incremental potential, by Newton's method with the positive semi-definite parts of
/// the Hessian and a line search.
///
/// Contact is a stiff one-sided spring per point; friction a spring to an anchor that is dragged along when it pulls harder
/// than Coulomb's limit, with the normal force of the last iterate. What is booked are the forces at the end of the step,
/// and the end velocity follows from them, so linear momentum balances to rounding. Backward Euler damps rotation: the loss
/// of angular momentum is the method's own and no booked moment covers it. Source: Li et al., "Incremental Potential
/// Contact", SIGGRAPH 2020, eq. (1) to (5), with springs for the barrier; the lagged normal force is section 5.4's.
template <int Dim>
class EulerStepper final : public StepperOf<Dim> {
 public:
  explicit EulerStepper(const SceneOf<Dim>& scene)
      : scene_(scene),
        matrix_(scene.body),
        anchor_(Dim, scene.contact_points.count()),
        contact_force_(Dim, scene.contact_points.count()),
        touching_(static_cast<std::size_t>(scene.contact_points.count()), 0),
        friction_limit_(scene.contact_points.count()),
        last_limit_(scene.contact_points.count()),
        foreseen_(Dim, scene.body.node_count()),
        moved_(Dim, scene.body.node_count()),
        trial_(Dim, scene.body.node_count()),
        residual_(Dim, scene.body.node_count()),
        force_(Dim, scene.body.node_count()),
        direction_(Dim * scene.body.node_count()),
        start_{scene.body.rest, scene.body.rest} {
    const double gravity = scene.gravity.norm();
    size_ = size_of_volume<Dim>(scene.body.rest_volume.sum());
    contact_stiffness_ = scene.body.mass.sum() * (gravity > 0 ? gravity : kWeightOfNoGravity) / (kSinkage * size_);
  }

  double substep(double dt) const override { return dt; }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    const BodyOf<Dim>& body = scene_.body;
    start_ = state;
    foreseen_ = state.x + dt * state.v;
    for (int i = 0; i < body.node_count(); ++i) {
      foreseen_.col(i) += dt * dt * scene_.gravity;
      if (effect_force != nullptr) foreseen_.col(i) += (dt * dt / body.mass[i]) * effect_force->col(i);
    }
    if (scene_.has_ground) lay_anchors();
    // The search starts where the body would be without forces between its nodes, unless that is a worse place than here.
    trial_ = state.x + dt * state.v;
    update_friction_limits(state.x);
    state.x = potential(trial_, dt, activation) < potential(state.x, dt, activation) ? trial_ : state.x;
    find_residual(state.x, dt, activation);
    double enough = kResidual * size_;
    for (int k = 0, updates = 0; k < kNewtonSteps; ++k) {
      if (residual_speed(dt) <= enough) {
        if (!scene_.has_ground) break;
        last_limit_ = friction_limit_;
        update_friction_limits(state.x);
        find_residual(state.x, dt, activation);
        if (residual_speed(dt) <= kResidual * size_) break;
        if (++updates > kFreeUpdates) {
          friction_limit_ = 0.5 * (friction_limit_ + last_limit_);
          find_residual(state.x, dt, activation);
        }
        enough = std::max(kResidual * size_, kInnerDecrease * residual_speed(dt));
      }
      if (!move_downhill(dt, activation, state.x)) break;
      find_residual(state.x, dt, activation);
    }
    update_friction_limits(state.x);
    find_residual(state.x, dt, activation);
    book(dt, effect_force, state, impulses);
    if (!state.v.allFinite() || !(residual_speed(dt) <= kGivenUp * size_)) {
      state = start_;
      return Termination::kDiverged;
    }
    if (scene_.has_ground) drag_anchors(state.x);
    return Termination::kDone;
  }

 private:
  double gap(const ConstPointsOf<Dim>& x, int p) const {
    return scene_.ground.normal.dot(scene_.contact_points.of(x, p)) - scene_.ground.offset;
  }

  /// From a point's anchor to the point, along the ground [m].
  VectorOf<Dim> travel(const ConstPointsOf<Dim>& x, int p) const {
    const VectorOf<Dim> whole = scene_.contact_points.of(x, p) - anchor_.col(p);
    return whole - scene_.ground.normal.dot(whole) * scene_.ground.normal;
  }

  void lay_anchors() {
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      if (!touching_[static_cast<std::size_t>(p)]) anchor_.col(p) = scene_.contact_points.of(start_.x, p);
    }
  }

  void drag_anchors(const ConstPointsOf<Dim>& x) {
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      touching_[static_cast<std::size_t>(p)] = friction_limit_[p] > 0 || gap(x, p) < 0;
      const VectorOf<Dim> from_anchor = travel(x, p);
      const double pull = contact_stiffness_ * from_anchor.norm();
      if (pull > friction_limit_[p]) anchor_.col(p) += (1 - friction_limit_[p] / pull) * from_anchor;
    }
  }

  void update_friction_limits(const ConstPointsOf<Dim>& x) {
    if (!scene_.has_ground) return;
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      friction_limit_[p] = scene_.ground.friction * contact_stiffness_ * std::max(0.0, -gap(x, p));
    }
  }

  /// What the step minimises [J].
  double potential(const PointsOf<Dim>& x, double dt, const Eigen::VectorXd& activation) const {
    const BodyOf<Dim>& body = scene_.body;
    double sum = elastic_energy(body, x, activation);
    for (int i = 0; i < body.node_count(); ++i) {
      sum += 0.5 * body.mass[i] * (x.col(i) - foreseen_.col(i)).squaredNorm() / (dt * dt);
    }
    for (int e = 0; e < body.edge_count(); ++e) {
      const int i = body.edges(0, e), j = body.edges(1, e);
      const VectorOf<Dim> span = start_.x.col(j) - start_.x.col(i);
      const double length_squared = span.squaredNorm();
      if (length_squared == 0) continue;
      const double along = (x.col(j) - x.col(i) - span).dot(span);
      sum += 0.5 * body.edge_damping[e] * along * along / (length_squared * dt);
    }
    if (!scene_.has_ground) return sum;
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      const double depth = std::min(0.0, gap(x, p));
      sum += 0.5 * contact_stiffness_ * depth * depth;
      if (friction_limit_[p] == 0) continue;
      const double limit = friction_limit_[p], distance = travel(x, p).norm(), pull = contact_stiffness_ * distance;
      sum += pull <= limit ? 0.5 * pull * distance : limit * (distance - 0.5 * limit / contact_stiffness_);
    }
    return sum;
  }

  /// Fills contact_force_ and residual_, the gradient of the potential [N].
  void find_residual(const PointsOf<Dim>& x, double dt, const Eigen::VectorXd& activation) {
    const BodyOf<Dim>& body = scene_.body;
    const ContactPointsOf<Dim>& points = scene_.contact_points;
    force_.setZero();
    add_elastic_forces(body, x, activation, force_);
    moved_ = (x - start_.x) / dt;
    add_damping_forces(body, start_.x, moved_, force_);
    contact_force_.setZero();
    if (scene_.has_ground) {
      for (int p = 0; p < points.count(); ++p) {
        VectorOf<Dim> push = VectorOf<Dim>::Zero();
        const double depth = gap(x, p);
        if (depth < 0) push = -contact_stiffness_ * depth * scene_.ground.normal;
        if (friction_limit_[p] > 0) {
          const VectorOf<Dim> from_anchor = travel(x, p);
          const double pull = contact_stiffness_ * from_anchor.norm();
          push -= (contact_stiffness_ * (pull > friction_limit_[p] ? friction_limit_[p] / pull : 1)) * from_anchor;
        }
        contact_force_.col(p) = push;
        for (int k = 0; k <= Dim; ++k) force_.col(points.nodes(k, p)) += points.weights(k, p) * push;
      }
    }
    for (int i = 0; i < body.node_count(); ++i) {
      residual_.col(i) = (body.mass[i] / (dt * dt)) * (x.col(i) - foreseen_.col(i)) - force_.col(i);
    }
  }

  double residual_speed(double dt) const {
    double largest = 0;
    for (int i = 0; i < scene_.body.node_count(); ++i) {
      const double speed = residual_.col(i).norm() * dt / scene_.body.mass[i];
      if (!(speed <= largest)) largest = speed;
    }
    return largest;
  }

  void add_contact_stiffness(const ConstPointsOf<Dim>& x) {
    const VectorOf<Dim> normal = scene_.ground.normal;
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      BlockOf<Dim> block = BlockOf<Dim>::Zero();
      if (gap(x, p) < 0) block = contact_stiffness_ * normal * normal.transpose();
      if (friction_limit_[p] > 0) {
        const VectorOf<Dim> from_anchor = travel(x, p);
        const double distance = from_anchor.norm();
        BlockOf<Dim> tangential = BlockOf<Dim>::Identity() - normal * normal.transpose();
        if (contact_stiffness_ * distance > friction_limit_[p]) {
          tangential -= from_anchor * from_anchor.transpose() / (distance * distance);
          tangential *= friction_limit_[p] / distance;
        } else {
          tangential *= contact_stiffness_;
        }
        block += tangential;
      }
      matrix_.add_contact(scene_.contact_points, p, block);
    }
  }

  /// One Newton step with line search. False: the potential cannot be lowered along it.
  bool move_downhill(double dt, const Eigen::VectorXd& activation, PointsOf<Dim>& x) {
    const BodyOf<Dim>& body = scene_.body;
    matrix_.set_zero();
    matrix_.add_mass(body, 1 / (dt * dt));
    matrix_.add_stiffness(body, x, activation, 1);
    matrix_.add_damping(body, start_.x, 1 / dt);
    if (scene_.has_ground) add_contact_stiffness(x);
    if (!matrix_.factor()) return false;
    direction_ = -residual_.reshaped();
    matrix_.solve_in_place(direction_);
    const double here = potential(x, dt, activation), slope = residual_.reshaped().dot(direction_);
    if (!(slope < 0)) return false;
    double part = 1;
    for (int k = 0; k < kHalvings; ++k, part /= 2) {
      trial_ = x + part * direction_.reshaped(Dim, body.node_count());
      if (potential(trial_, dt, activation) <= here + kArmijo * part * slope + kRounding * std::abs(here)) {
        x.swap(trial_);
        return true;
      }
    }
    return false;
  }

  void book(double dt, const PointsOf<Dim>* effect_force, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const {
    const BodyOf<Dim>& body = scene_.body;
    const ContactPointsOf<Dim>& points = scene_.contact_points;
    impulses.contact = dt * contact_force_;
    impulses.contact_nodes.setZero();
    impulses.contact_moment.setZero();
    for (int p = 0; p < points.count(); ++p) {
      const VectorOf<Dim> impulse = impulses.contact.col(p), place = points.of(state.x, p);
      for (int k = 0; k <= Dim; ++k) impulses.contact_nodes.col(points.nodes(k, p)) += points.weights(k, p) * impulse;
      impulses.contact_moment += cross<Dim>(place, impulse);
    }
    impulses.effect_nodes.setZero();
    impulses.effect_moment.setZero();
    if (effect_force != nullptr) {
      impulses.effect_nodes = dt * *effect_force;
      for (int i = 0; i < body.node_count(); ++i) {
        impulses.effect_moment += dt * cross<Dim>(state.x.col(i), effect_force->col(i));
      }
    }
    impulses.gravity_moment = dt * cross<Dim>(state.x * body.mass, scene_.gravity);
    state.v = start_.v + impulses.effect_nodes * body.mass.cwiseInverse().asDiagonal();
    for (int i = 0; i < body.node_count(); ++i) state.v.col(i) += dt * (force_.col(i) / body.mass[i] + scene_.gravity);
  }

  const SceneOf<Dim>& scene_;
  SystemMatrixOf<Dim> matrix_;
  double size_ = 0, contact_stiffness_ = 0;      // [m], [N/m] of a contact point, normal and tangential
  PointsOf<Dim> anchor_, contact_force_;         // [m], [N] Dim x P
  std::vector<char> touching_;                   // P: at the end of the last step
  Eigen::VectorXd friction_limit_, last_limit_;  // [N] P, of this and the last Newton step
  PointsOf<Dim> foreseen_;                       // [m] where gravity and effects alone take the nodes
  PointsOf<Dim> moved_, trial_, residual_, force_;
  Eigen::VectorXd direction_;
  StateOf<Dim> start_;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_euler_stepper(const SceneOf<Dim>& scene) {
  return std::make_unique<EulerStepper<Dim>>(scene);
}
template std::unique_ptr<StepperOf<2>> make_euler_stepper<2>(const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_euler_stepper<3>(const SceneOf<3>&);

}  // namespace hydrostat::physics

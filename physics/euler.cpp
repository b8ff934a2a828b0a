#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/elastic_forces.h"
#include "physics/internal_forces.h"
#include "physics/penalty_contact.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr int kNewtonSteps = 100;  // three or four are the rule
// Normal forces set Coulomb's limits, and these the normal forces: where the two go round in circles the limits follow by
// smaller and smaller parts.
constexpr int kFreeUpdates = 3;
constexpr double kShorterUpdate = 0.7;
// A node's residual force is told as the velocity that it would give the node in a step, over the body's size [1/s].
constexpr double kResidual = 1e-4;      // small enough
constexpr double kInnerDecrease = 0.3;  // of the residual [-] between two updates of the friction limits
constexpr double kGivenUp = 1e-2;       // after the last iterate: no minimum was found
constexpr double kArmijo = 1e-4;
constexpr int kHalvings = 20;
constexpr double kFlatter = 0.5;  // slope at the end of a step over that at its start [-] where rounding hides the potential
constexpr double kReach = 0.25;   // of the body's size [-]: what is nearer than that is watched
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
        forces_(scene.body),
        matrix_(scene.body),
        contact_(scene),
        size_(size_of_volume<Dim>(scene.body.rest_volume.sum())),
        foreseen_(Dim, scene.body.node_count()),
        moved_(Dim, scene.body.node_count()),
        trial_(Dim, scene.body.node_count()),
        residual_(Dim, scene.body.node_count()),
        force_(Dim, scene.body.node_count()),
        direction_(Dim * scene.body.node_count()),
        start_{scene.body.rest, scene.body.rest} {}

  double substep(double dt) const override { return dt; }
  /// Steps that ended above the minimum.
  long guard_steps() const override { return unsolved_; }

  StepWork work() const override {
    StepWork work = work_;
    work.by_potential = contact_.work();
    return work;
  }

  void forget() override { contact_.forget(); }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    const BodyOf<Dim>& body = scene_.body;
    if (!forces_.set_activation(activation)) return Termination::kDiverged;
    start_ = state;
    for (const int node : body.held) state.v.col(node).setZero();
    foreseen_ = state.x + dt * state.v;
    for (int i = 0; i < body.node_count(); ++i) {
      foreseen_.col(i) += dt * dt * scene_.gravity;
      if (effect_force != nullptr) foreseen_.col(i) += (dt * dt / body.mass[i]) * effect_force->col(i);
    }
    for (const int node : body.held) foreseen_.col(node) = state.x.col(node);
    // The search starts where the body would be without forces between its nodes, unless that is a worse place than here.
    trial_ = state.x + dt * state.v;
    if (contact_.is_needed()) {
      contact_.begin(start_, foreseen_, dt, reach(dt));
      contact_.update_friction(state.x);
    }
    state.x = potential(trial_, dt) < potential(state.x, dt) ? trial_ : state.x;
    bool has_moved = false;
    find_residual(state.x, dt);
    double enough = kResidual * size_, part = 1, last = std::numeric_limits<double>::infinity();
    for (int k = 0, updates = 0; k < kNewtonSteps; ++k) {
      if (residual_speed(dt) <= enough) {
        if (!contact_.is_needed()) break;
        contact_.update_friction(state.x);
        find_residual(state.x, dt);
        if (residual_speed(dt) <= kResidual * size_) break;
        if (++updates > kFreeUpdates) {
          if (residual_speed(dt) > kShorterUpdate * last) part *= kShorterUpdate;
          last = residual_speed(dt);
          contact_.shorten_friction_update(part);
          find_residual(state.x, dt);
        }
        enough = std::max(kResidual * size_, kInnerDecrease * residual_speed(dt));
      }
      if (!move_downhill(dt, state.x)) break;
      has_moved = true;
      find_residual(state.x, dt);
    }
    if (contact_.is_needed()) contact_.update_friction(state.x);
    find_residual(state.x, dt);
    book(dt, effect_force, state, impulses);
    const bool is_solved = residual_speed(dt) <= kGivenUp * size_;
    if (!is_solved && has_moved) {
      follow_places(dt, state, impulses);
      ++unsolved_;
    }
    if ((!is_solved && !has_moved) || !std::isfinite(state.v.squaredNorm()) || !state.x.allFinite()) {
      state = start_;
      return Termination::kDiverged;
    }
    if (contact_.is_needed()) contact_.end(state.x, state.obstacle_travel);
    return Termination::kDone;
  }

 private:
  /// Farther than the body will move against the obstacles in this step [m].
  double reach(double dt) const {
    double fastest = 0;
    for (int i = 0; i < scene_.body.node_count(); ++i) {
      fastest = std::max(fastest, std::max(start_.v.col(i).norm(), (foreseen_.col(i) - start_.x.col(i)).norm() / dt));
    }
    return 2 * dt * fastest + kReach * size_;
  }

  /// What the step minimises [J].
  double potential(const PointsOf<Dim>& x, double dt) {
    const BodyOf<Dim>& body = scene_.body;
    double sum = forces_.elastic_energy(x);
    for (int i = 0; i < body.node_count(); ++i) {
      sum += 0.5 * body.mass[i] * (x.col(i) - foreseen_.col(i)).squaredNorm() / (dt * dt);
    }
    sum += damping_potential<Dim>(body, start_.x, start_.x, x) / dt;
    return contact_.is_needed() ? sum + contact_.potential(x) : sum;
  }

  /// Fills force_ and residual_, the gradient of the potential [N].
  void find_residual(const PointsOf<Dim>& x, double dt) {
    const BodyOf<Dim>& body = scene_.body;
    force_.setZero();
    forces_.add_elastic_forces(x, force_);
    moved_ = (x - start_.x) / dt;
    add_damping_forces(body, start_.x, moved_, force_);
    if (contact_.is_needed()) contact_.add_forces(x, force_);
    for (int i = 0; i < body.node_count(); ++i) {
      residual_.col(i) = (body.mass[i] / (dt * dt)) * (x.col(i) - foreseen_.col(i)) - force_.col(i);
    }
    for (const int node : body.held) residual_.col(node).setZero();
  }

  double residual_speed(double dt) const {
    double largest = 0;
    for (int i = 0; i < scene_.body.node_count(); ++i) {
      const double speed = residual_.col(i).norm() * dt / scene_.body.mass[i];
      if (!(speed <= largest)) largest = speed;
    }
    return largest;
  }

  /// One Newton step with line search. False: the potential cannot be lowered along it.
  ///
  /// The energy of stiff elements is rounded by more than light nodes have to lose. Where no part of the step lowers the
  /// potential to be seen, its slope decides, which is not the difference of two large numbers. Source: Hager, Zhang, "A new
  /// conjugate gradient method with guaranteed descent and an efficient line search", SIAM J. Optim. 16(1), 2005, section 4,
  /// whose approximate Wolfe conditions are that of the slope.
  bool move_downhill(double dt, PointsOf<Dim>& x) {
    const BodyOf<Dim>& body = scene_.body;
    ++work_.rounds;
    ++work_.assemblies;
    work_.products += matrix_.products_to_factor() + matrix_.products_to_solve();
    work_.passes += 2;  // the potential here and the residual before
    matrix_.set_zero();
    matrix_.add_mass(body, 1 / (dt * dt));
    forces_.add_stiffness(x, 1, matrix_);
    matrix_.add_damping(body, start_.x, 1 / dt);
    if (contact_.is_needed()) contact_.add_stiffness(x, 1, matrix_);
    matrix_.hold(body.held);
    if (!matrix_.factor()) return false;
    direction_ = -residual_.reshaped();
    matrix_.solve_in_place(direction_);
    for (const int node : body.held) direction_.template segment<Dim>(Dim * node).setZero();
    const double here = potential(x, dt), slope = residual_.reshaped().dot(direction_);
    if (!(slope < 0)) return false;
    double part = 1;
    for (int k = 0; k < kHalvings; ++k, part /= 2) {
      ++work_.passes;
      trial_ = x + part * direction_.reshaped(Dim, body.node_count());
      if (potential(trial_, dt) <= here + kArmijo * part * slope + kRounding * std::abs(here)) {
        x.swap(trial_);
        return true;
      }
    }
    trial_ = x + direction_.reshaped(Dim, body.node_count());
    find_residual(trial_, dt);
    if (!(std::abs(residual_.reshaped().dot(direction_)) <= kFlatter * std::abs(slope))) return false;
    x.swap(trial_);
    return true;
  }

  void book(double dt, const PointsOf<Dim>* effect_force, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const {
    const BodyOf<Dim>& body = scene_.body;
    clear(impulses);
    if (contact_.is_needed()) {
      contact_.book(dt, state.x, impulses);
      impulses.obstacle_work += contact_.lift_work();
    }
    if (effect_force != nullptr) {
      impulses.effect_nodes = dt * *effect_force;
      for (int i = 0; i < body.node_count(); ++i) {
        impulses.effect_moment += dt * cross<Dim>(state.x.col(i), effect_force->col(i));
      }
    }
    impulses.gravity_moment = dt * cross<Dim>(state.x * body.mass, scene_.gravity);
    state.v = start_.v + impulses.effect_nodes * body.mass.cwiseInverse().asDiagonal();
    for (int i = 0; i < body.node_count(); ++i) state.v.col(i) += dt * (force_.col(i) / body.mass[i] + scene_.gravity);
    for (std::size_t n = 0; n < body.held.size(); ++n) {
      const int node = body.held[n];
      impulses.hold.col(static_cast<Eigen::Index>(n)) = -body.mass[node] * state.v.col(node);
      state.v.col(node).setZero();
    }
  }

  /// Where the search ended above the minimum the velocities are those of the places, which lowered the potential and thus
  /// gained no energy, and what the forces leave unexplained counts as forces inside the body: all but its sum, which a
  /// common velocity takes back (or what holds the held nodes), so that momentum balances as ever.
  void follow_places(double dt, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const {
    const BodyOf<Dim>& body = scene_.body;
    const VectorOf<Dim> booked = momentum<Dim>(body, state.v);
    state.v = (state.x - start_.x) / dt;
    const VectorOf<Dim> missing = booked - momentum<Dim>(body, state.v);
    if (body.held.empty()) {
      state.v.colwise() += missing / body.mass.sum();
    } else {
      impulses.hold.colwise() -= missing / static_cast<double>(body.held.size());
    }
  }

  const SceneOf<Dim>& scene_;
  InternalForces<Dim> forces_;
  SystemMatrixOf<Dim> matrix_;
  PenaltyContact<Dim> contact_;
  double size_;             // [m]
  PointsOf<Dim> foreseen_;  // [m] where gravity and effects alone take the nodes
  PointsOf<Dim> moved_, trial_, residual_, force_;
  Eigen::VectorXd direction_;
  StateOf<Dim> start_;
  long unsolved_ = 0;
  StepWork work_;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_euler_stepper(const SceneOf<Dim>& scene) {
  return std::make_unique<EulerStepper<Dim>>(scene);
}
template std::unique_ptr<StepperOf<2>> make_euler_stepper<2>(const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_euler_stepper<3>(const SceneOf<3>&);

}  // namespace hydrostat::physics

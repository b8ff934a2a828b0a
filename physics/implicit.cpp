#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "physics/elastic_forces.h"
#include "physics/internal_forces.h"
#include "physics/penalty_contact.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr int kIterations = 200;  // ten are the rule
constexpr int kMemory = 8;        // pairs of L-BFGS
constexpr int kPatience = 20;     // iterations between two new matrices
constexpr int kSlow = 12;         // a step of more iterations makes the next one start from a new matrix
// Normal forces set Coulomb's limits, and these the normal forces: where the two go round in circles the limits follow by
// smaller and smaller parts.
constexpr int kFreeUpdates = 3;
constexpr double kShorterUpdate = 0.7;
constexpr int kMostTurns = 8;  // of the dashpots: where that is not enough a little angular momentum is lost, never energy won
// A node's residual force is told as the velocity that it would give the node in a step, in sqrt(g D): what a body of 1 mm and
// one of 100 m have in common.
constexpr double kResidual = 2e-6;      // [-] small enough: a turning body loses angular momentum by it
constexpr double kInnerDecrease = 0.3;  // of the residual [-] between two updates of what the potential takes as given
constexpr double kGivenUp = 2e-3;       // [-] after the last iterate: no solution was found
constexpr double kGravity = 9.81;       // [m/s^2] of these units, where the scene has none, too
constexpr double kLongestSubstep = 1.0 / 12;  // of sqrt(D / g) [-], 1/60 s at D = 0.4 m: the midpoint rule lets energy swing by more
constexpr double kArmijo = 1e-4;
constexpr int kHalvings = 20;
constexpr double kReach = 0.25;      // of the body's size [-]: what is nearer than that is watched
constexpr double kJump = 0.05;       // of an activation between two steps [-]
constexpr double kRounding = 1e-12;  // of the potential [-]: a smaller decrease is none

/// Implicit midpoint as the minimum of a potential, by L-BFGS on top of a factored Hessian that is kept from step to step and
/// made anew where convergence is slow.
///
/// Internal forces are those of the middle x_m = (x0 + x1) / 2, so they change neither momentum nor angular momentum, but for
/// what the solver leaves (kResidual). Dashpots pull along the edges of the middle, too, so that they only ever take energy: as
/// friction limits do, these directions follow the iterates, for no potential has them. Contact comes in two impulses, one
/// before the motion and one after it: the first keeps the places at the end of the step out of the obstacles, a stiff spring
/// on x1 with anchored friction as in euler, booked where the step starts; the second, booked where it ends, takes away what
/// velocity of touching places still approaches or slides. A body at rest thus has no velocity, and both impulses together
/// are its weight.
/// Source: Liu, Bouaziz, Kavan, "Quasi-Newton methods for real-time simulation of hyperelastic materials", TOG 36(3), 2017,
/// section 4 (we take the projected Hessian of a past state for their Laplacian); Hairer, Lubich, Wanner, "Geometric numerical
/// integration", 2006, eq. (I.1.7) for the midpoint rule and theorem IV.2.1 for what it keeps.
template <int Dim>
class ImplicitStepper final : public StepperOf<Dim> {
 public:
  explicit ImplicitStepper(const SceneOf<Dim>& scene)
      : scene_(scene),
        forces_(scene.body, scene.threads),
        matrix_(scene.body),
        contact_(scene),
        size_(size_of_volume<Dim>(scene.body.rest_volume.sum())),
        speed_(std::sqrt(kGravity * size_)),
        inverse_mass_(inverse_masses(scene.body)),
        foreseen_(scene.body.rest),
        damped_(scene.body.rest),
        middle_(scene.body.rest),
        moved_(scene.body.rest),
        trial_(scene.body.rest),
        force_(scene.body.rest),
        residual_(scene.body.rest),
        last_residual_(scene.body.rest),
        direction_(Dim * scene.body.node_count()),
        start_{scene.body.rest, scene.body.rest},
        whole_start_(start_),
        part_(make_impulses(scene)),
        longest_substep_(kLongestSubstep * std::sqrt(size_ / kGravity)) {
    for (Pair& pair : pairs_) pair = {direction_, direction_, 0};
  }

  double substep(double dt) const override { return dt / std::ceil(dt / longest_substep_); }

  StepWork work() const override {
    StepWork work = work_;
    work.by_potential = contact_.work();
    return work;
  }

  void forget() override { contact_.forget(); }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    if (!forces_.set_activation(activation)) return Termination::kDiverged;
    const int substeps = substeps_for(dt, activation);
    if (substeps == 1) return take_substep(dt, effect_force, state, impulses);
    clear(impulses);
    whole_start_ = state;
    for (int s = 0; s < substeps; ++s) {
      if (take_substep(dt / substeps, effect_force, state, part_) == Termination::kDiverged) {
        state = whole_start_;
        return Termination::kDiverged;
      }
      add(part_, impulses);
    }
    return Termination::kDone;
  }

 private:
  /// The midpoint rule throws a stiff mode from one side to the other in every substep. Activations that jump from step to step
  /// would push it each time it comes by; over two substeps of one activation the pushes cancel.
  int substeps_for(double dt, const Eigen::VectorXd& activation) {
    int substeps = static_cast<int>(std::ceil(dt / longest_substep_));
    const bool has_jumped =
        last_activation_.size() == activation.size() && (activation - last_activation_).cwiseAbs().maxCoeff() > kJump;
    if (has_jumped && substeps % 2 == 1) ++substeps;
    last_activation_ = activation;
    return substeps;
  }

  struct Pair {
    Eigen::VectorXd step, change;  // of the places and of the residual
    double inverse_product;
  };

  Termination take_substep(double dt, const PointsOf<Dim>* effect_force, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
    begin(dt, effect_force, state);
    const bool is_solved = minimise(state.x);
    book(effect_force, state, impulses);
    if (!is_solved || !state.v.allFinite()) {
      state = start_;
      has_matrix_ = false;
      return Termination::kDiverged;
    }
    if (contact_.is_needed()) contact_.end(state.x, state.obstacle_travel);
    return Termination::kDone;
  }

  void begin(double dt, const PointsOf<Dim>* effect_force, StateOf<Dim>& state) {
    const BodyOf<Dim>& body = scene_.body;
    start_ = state;
    for (const int node : body.held) state.v.col(node).setZero();
    if (dt != dt_) has_matrix_ = false;
    dt_ = dt;
    trial_ = state.x + dt * state.v;
    foreseen_ = trial_;
    for (int i = 0; i < body.node_count(); ++i) {
      foreseen_.col(i) += (0.5 * dt * dt) * scene_.gravity;
      if (effect_force != nullptr) foreseen_.col(i) += (0.5 * dt * dt / body.mass[i]) * effect_force->col(i);
    }
    for (const int node : body.held) foreseen_.col(node) = state.x.col(node);
    damped_ = start_.x + 0.5 * dt * start_.v;
    turns_ = 0;
    if (contact_.is_needed()) {
      contact_.begin(start_, foreseen_, dt, reach());
      contact_.update_friction(state.x);
    }
    if (potential(trial_) < potential(state.x)) state.x = trial_;
  }

  /// Farther than the body will move against the obstacles in this step [m].
  double reach() const {
    double farthest = 0;
    for (int i = 0; i < scene_.body.node_count(); ++i) {
      farthest = std::max(farthest, std::max(dt_ * start_.v.col(i).norm(), (foreseen_.col(i) - start_.x.col(i)).norm()));
    }
    return 2 * farthest + kReach * size_;
  }

  /// What the potential takes as given, friction limits and directions of dashpots, as it is at `x`.
  void update_given(const PointsOf<Dim>& x) {
    if (contact_.is_needed()) contact_.update_friction(x);
    if (++turns_ <= kMostTurns) damped_ = 0.5 * (start_.x + x);
  }

  /// What the step minimises over the places at its end [J].
  double potential(const PointsOf<Dim>& x) {
    ++work_.passes;
    middle_ = 0.5 * (start_.x + x);
    double sum = 2 * forces_.elastic_energy(middle_);
    if (forces_.has_dashpots()) sum += damping_potential<Dim>(scene_.body, damped_, start_.x, x) / dt_;
    for (int i = 0; i < scene_.body.node_count(); ++i) {
      sum += scene_.body.mass[i] * (x.col(i) - foreseen_.col(i)).squaredNorm() / (dt_ * dt_);
    }
    return contact_.is_needed() ? sum + contact_.potential(x) : sum;
  }

  /// Fills residual_, the gradient of the potential [N], and force_, of the middle, without contact.
  void find_residual(const PointsOf<Dim>& x) {
    const BodyOf<Dim>& body = scene_.body;
    ++work_.passes;
    middle_ = 0.5 * (start_.x + x);
    force_.setZero();
    forces_.add_elastic_forces(middle_, force_);
    if (forces_.has_dashpots()) {
      moved_ = (x - start_.x) / dt_;
      add_damping_forces<Dim>(body, damped_, moved_, force_);
    }
    residual_.setZero();
    if (contact_.is_needed()) contact_.add_forces(x, residual_);
    for (int i = 0; i < body.node_count(); ++i) {
      residual_.col(i) = (2 * body.mass[i] / (dt_ * dt_)) * (x.col(i) - foreseen_.col(i)) - force_.col(i) - residual_.col(i);
    }
    for (const int node : body.held) residual_.col(node).setZero();
  }

  double residual_speed() const {
    double largest = 0;
    for (int i = 0; i < scene_.body.node_count(); ++i) {
      const double speed = residual_.col(i).norm() * dt_ / scene_.body.mass[i];
      if (!(speed <= largest)) largest = speed;
    }
    return largest;
  }

  bool minimise(PointsOf<Dim>& x) {
    find_residual(x);
    count_ = 0;
    since_matrix_ = 0;
    double enough = kResidual * speed_, part = 1, last = std::numeric_limits<double>::infinity();
    int k = 0, updates = 0;
    for (; k < kIterations; ++k) {
      if (residual_speed() <= enough) {
        if (!contact_.is_needed() && !forces_.has_dashpots()) break;
        update_given(x);
        find_residual(x);
        count_ = 0;  // the pairs are of another potential
        if (residual_speed() <= kResidual * speed_) break;
        if (++updates > kFreeUpdates && contact_.is_needed()) {
          if (residual_speed() > kShorterUpdate * last) part *= kShorterUpdate;
          last = residual_speed();
          contact_.shorten_friction_update(part);
          find_residual(x);
        }
        enough = std::max(kResidual * speed_, kInnerDecrease * residual_speed());
      }
      if (!has_matrix_ || since_matrix_ >= kPatience) {
        if (!make_matrix(x)) return false;
      }
      if (move_downhill(x)) {
        ++since_matrix_;
      } else if (since_matrix_ == 0) {
        break;  // not along the Hessian's own direction either
      } else {
        has_matrix_ = false;
      }
    }
    if (k > kSlow) has_matrix_ = false;
    update_given(x);
    find_residual(x);
    return residual_speed() <= kGivenUp * speed_;
  }

  bool make_matrix(const PointsOf<Dim>& x) {
    ++work_.assemblies;
    work_.products += matrix_.products_to_factor();
    middle_ = 0.5 * (start_.x + x);
    matrix_.set_zero();
    matrix_.add_mass(scene_.body, 2 / (dt_ * dt_));
    forces_.add_stiffness(middle_, 0.5, matrix_);
    if (forces_.has_dashpots()) matrix_.add_damping(scene_.body, damped_, 1 / dt_);
    if (contact_.is_needed()) contact_.add_stiffness(x, 1, matrix_);
    matrix_.hold(scene_.body.held);
    has_matrix_ = matrix_.factor();
    count_ = 0;
    since_matrix_ = 0;
    return has_matrix_;
  }

  /// Two-loop recursion. Source: Nocedal, Wright, "Numerical optimization", 2006, algorithm 7.4.
  void find_direction() {
    ++work_.rounds;
    work_.products += matrix_.products_to_solve();
    std::array<double, kMemory> along{};
    const int oldest = std::max(0, count_ - kMemory);
    direction_ = -residual_.reshaped();
    for (int k = count_ - 1; k >= oldest; --k) {
      const Pair& pair = pairs_[static_cast<std::size_t>(k % kMemory)];
      along[static_cast<std::size_t>(k % kMemory)] = pair.inverse_product * pair.step.dot(direction_);
      direction_ -= along[static_cast<std::size_t>(k % kMemory)] * pair.change;
    }
    matrix_.solve_in_place(direction_);
    for (int k = oldest; k < count_; ++k) {
      const Pair& pair = pairs_[static_cast<std::size_t>(k % kMemory)];
      const double back = pair.inverse_product * pair.change.dot(direction_);
      direction_ += (along[static_cast<std::size_t>(k % kMemory)] - back) * pair.step;
    }
    for (const int node : scene_.body.held) direction_.template segment<Dim>(Dim * node).setZero();
  }

  /// One step with line search; leaves residual_ at its end. False: the potential cannot be lowered along it.
  bool move_downhill(PointsOf<Dim>& x) {
    find_direction();
    const double here = potential(x), slope = residual_.reshaped().dot(direction_);
    if (!(slope < 0)) return false;
    double part = 1;
    for (int k = 0; k < kHalvings; ++k, part /= 2) {
      trial_ = x + part * direction_.reshaped(Dim, x.cols());
      if (!(potential(trial_) <= here + kArmijo * part * slope + kRounding * std::abs(here))) continue;
      x.swap(trial_);
      last_residual_ = residual_;
      find_residual(x);
      Pair& pair = pairs_[static_cast<std::size_t>(count_ % kMemory)];
      pair.step = part * direction_;
      pair.change = (residual_ - last_residual_).reshaped();
      const double product = pair.step.dot(pair.change);
      if (product > 0) {
        pair.inverse_product = 1 / product;
        ++count_;
      }
      return true;
    }
    return false;
  }

  void book(const PointsOf<Dim>* effect_force, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
    const BodyOf<Dim>& body = scene_.body;
    clear(impulses);
    if (contact_.is_needed()) {
      contact_.book(0.5 * dt_, start_.x, impulses);
      impulses.obstacle_work += 0.5 * contact_.lift_work();
    }
    middle_ = 0.5 * (start_.x + state.x);
    if (effect_force != nullptr) {
      impulses.effect_nodes = dt_ * *effect_force;
      for (int i = 0; i < body.node_count(); ++i) {
        impulses.effect_moment += dt_ * cross<Dim>(middle_.col(i), effect_force->col(i));
      }
    }
    impulses.gravity_moment = dt_ * cross<Dim>(middle_ * body.mass, scene_.gravity);
    for (int i = 0; i < body.node_count(); ++i) {
      VectorOf<Dim> impulse = dt_ * force_.col(i) + impulses.contact_nodes.col(i) + impulses.effect_nodes.col(i);
      if (contact_.has_internal()) impulse += impulses.internal_nodes.col(i);
      state.v.col(i) = start_.v.col(i) + impulse / body.mass[i] + dt_ * scene_.gravity;
    }
    for (std::size_t n = 0; n < body.held.size(); ++n) {
      const int node = body.held[n];
      impulses.hold.col(static_cast<Eigen::Index>(n)) = impulses.contact_nodes.col(node) - body.mass[node] * state.v.col(node);
      if (contact_.has_internal()) impulses.hold.col(static_cast<Eigen::Index>(n)) += impulses.internal_nodes.col(node);
      state.v.col(node).setZero();
    }
    if (contact_.is_needed()) {
      contact_.stop_approach(state.x, inverse_mass_, state.v);
      contact_.book(1, state.x, impulses);
    }
    for (std::size_t n = 0; n < body.held.size(); ++n) {
      impulses.hold.col(static_cast<Eigen::Index>(n)) -= impulses.contact_nodes.col(body.held[n]);
      if (contact_.has_internal()) impulses.hold.col(static_cast<Eigen::Index>(n)) -= impulses.internal_nodes.col(body.held[n]);
    }
  }

  const SceneOf<Dim>& scene_;
  InternalForces<Dim> forces_;
  SystemMatrixOf<Dim> matrix_;
  PenaltyContact<Dim> contact_;
  double size_, speed_, dt_ = 0;  // [m], [m/s], [s]
  Eigen::VectorXd inverse_mass_;
  PointsOf<Dim> foreseen_;  // [m] where velocities, gravity and effects alone take the nodes
  PointsOf<Dim> damped_;    // [m] along whose edges the dashpots pull
  PointsOf<Dim> middle_, moved_, trial_, force_, residual_, last_residual_;
  Eigen::VectorXd direction_, last_activation_;
  StateOf<Dim> start_, whole_start_;  // of a substep; of the step
  ImpulsesOf<Dim> part_;
  double longest_substep_;  // [s]
  std::array<Pair, kMemory> pairs_;
  int turns_ = 0;                     // of the dashpots in this step
  int count_ = 0, since_matrix_ = 0;  // pairs since they were last cleared; iterations since the matrix was made
  bool has_matrix_ = false;
  StepWork work_;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_implicit_stepper(const SceneOf<Dim>& scene) {
  return std::make_unique<ImplicitStepper<Dim>>(scene);
}
template std::unique_ptr<StepperOf<2>> make_implicit_stepper<2>(const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_implicit_stepper<3>(const SceneOf<3>&);

}  // namespace hydrostat::physics

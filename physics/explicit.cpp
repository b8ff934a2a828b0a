#include <algorithm>
#include <cmath>

#include "physics/impulse_contact.h"
#include "physics/internal_forces.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr double kStepMargin = 0.8;    // of the linear stability bound

struct StiffestMode {
  double damping;            // [1/s]
  double frequency_squared;  // [1/s2]
};

double longest_substep(const StiffestMode& mode) {
  return (std::sqrt(mode.damping * mode.damping + 4 * mode.frequency_squared) - mode.damping) / mode.frequency_squared;
}

/// The mode that limits the substep h of the linear motion about the rest shape: while 4 M - 2 h D - h^2 K stays positive,
/// the roots of the amplification polynomial stay in the unit disc. The dashpots act along edges alone, the stiffest modes
/// are those of volume: with D itself the bound is several times longer than with D = (largest damping time) K.
template <int Dim>
StiffestMode stiffest_mode_at_rest(const BodyOf<Dim>& body, const InternalForces<Dim>& forces) {
  SystemMatrixOf<Dim> stiffness(body), damping(body);
  stiffness.set_zero();
  forces.add_stiffness(body.rest, 1, stiffness);
  damping.set_zero();
  damping.add_damping(body, body.rest, 1);
  Eigen::VectorXd root_mass(Dim * body.node_count());
  for (int i = 0; i < body.node_count(); ++i) root_mass.segment<Dim>(Dim * i).setConstant(std::sqrt(body.mass[i]));
  Eigen::VectorXd y(root_mass.size()), kz(y.size()), dz(y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = std::cos(1.7 * static_cast<double>(i * i % 97));
  // Power iteration on M^-1 (2 h D + h^2 K) / 4 while h follows its largest eigenvalue toward 1, by Rayleigh's quotient.
  StiffestMode mode{};
  for (int k = 0; k < 300; ++k) {
    y.normalize();
    const Eigen::VectorXd z = y.cwiseQuotient(root_mass);
    kz = (stiffness.lower().template selfadjointView<Eigen::Lower>() * z).cwiseQuotient(root_mass);
    dz = (damping.lower().template selfadjointView<Eigen::Lower>() * z).cwiseQuotient(root_mass);
    mode = {y.dot(dz), y.dot(kz)};
    const double h = longest_substep(mode);
    y = 2 * h * dz + h * h * kz;
  }
  return mode;
}

/// Symplectic Euler (velocity Verlet with velocities at half steps) with contact by impulses.
///
/// Internal forces are pairwise and taken at the positions from which the step starts, so linear and angular momentum
/// change by the booked impulses alone, to rounding. Contact is solved on the velocity that moves the body: a point at gap g
/// may approach with g / h at most; projected Gauss-Seidel over the points inside Coulomb's cone (Moreau's time stepping).
/// Source: Hairer, Lubich, Wanner, "Geometric numerical integration", 2006, eq. (I.1.9) and, with velocities at half steps,
/// (I.1.17); Jean, "The non-smooth contact dynamics method", CMAME 177, 1999, for contact.
template <int Dim>
class ExplicitStepper final : public StepperOf<Dim> {
 public:
  ExplicitStepper(const SceneOf<Dim>& scene, double most_substeps)
      : scene_(scene),
        forces_(scene.body, scene.threads),
        force_(Dim, scene.body.node_count()),
        inverse_mass_(scene.body.mass.cwiseInverse()),
        contact_(scene),
        is_between_(!scene.body.elements.empty()),
        most_substeps_(most_substeps) {
    mode_at_rest_ = stiffest_mode_at_rest(scene.body, forces_);
    shortest_edge_ = scene.body.rest_length.minCoeff();
  }

  double substep(double dt) const override { return dt / std::ceil(dt / (kStepMargin * longest_substep(mode_at_rest_))); }

  StepWork work() const override {
    StepWork work = work_;
    work.by_impulses = contact_.work();
    return work;
  }

  void forget() override { contact_.forget(); }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    if (!forces_.set_activation(activation)) return Termination::kDiverged;
    start_ = state;
    // The bound at rest, shortened by as much as the shape from which the step starts is stiffer.
    StiffestMode mode = mode_at_rest_;
    mode.frequency_squared *= forces_.stiffening(state.x);
    const double count = std::ceil(dt / (kStepMargin * longest_substep(mode)));
    if (!(count <= most_substeps_)) return Termination::kDiverged;
    const int substeps = static_cast<int>(count);
    work_.passes += substeps;
    work_.rounds += substeps;
    const double h = dt / substeps;
    clear(impulses);
    contact_.forget_reach();
    begin_between(h, state, impulses);
    for (int s = 0; s < substeps; ++s) {
      force_.setZero();
      forces_.add_forces(state, force_);
      if (effect_force != nullptr) {
        force_ += *effect_force;
        impulses.effect_nodes += h * *effect_force;
        for (int i = 0; i < scene_.body.node_count(); ++i) {
          impulses.effect_moment += h * cross<Dim>(state.x.col(i), effect_force->col(i));
        }
      }
      hold(h, state, impulses);
      double fastest = 0;
      for (int i = 0; i < scene_.body.node_count(); ++i) {
        state.v.col(i) += h * (inverse_mass_[i] * force_.col(i) + scene_.gravity);
        const double speed_squared = state.v.col(i).squaredNorm();
        if (!(speed_squared <= fastest)) fastest = speed_squared;  // keeps what is not a number
      }
      impulses.gravity_moment += h * cross<Dim>(state.x * scene_.body.mass, scene_.gravity);
      const double farthest = h * std::sqrt(fastest);
      if (!(farthest < shortest_edge_)) {
        state = start_;
        return Termination::kDiverged;
      }
      if (contact_.is_needed()) contact_.push_apart(h, std::sqrt(fastest), state, impulses);
      state.x += h * state.v;
    }
    if (is_between_) state.x -= (0.5 * h) * state.v;
    for (std::size_t n = 0; n < scene_.body.held.size(); ++n) {
      impulses.hold.col(static_cast<Eigen::Index>(n)) -= impulses.contact_nodes.col(scene_.body.held[n]);
      if (contact_.has_internal()) impulses.hold.col(static_cast<Eigen::Index>(n)) -= impulses.internal_nodes.col(scene_.body.held[n]);
    }
    return Termination::kDone;
  }

 private:
  /// Takes the places half a substep on, where the velocities that come in and go out are those of the whole step: an error of
  /// second order instead of first, at no cost. Bodies of springs and volumes alone keep the motion that they always had.
  void begin_between(double h, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const {
    if (!is_between_) return;
    for (std::size_t n = 0; n < scene_.body.held.size(); ++n) {
      const int node = scene_.body.held[n];
      impulses.hold.col(static_cast<Eigen::Index>(n)) -= scene_.body.mass[node] * state.v.col(node);
      state.v.col(node).setZero();
    }
    state.x += (0.5 * h) * state.v;
  }

  /// Turns the force on held nodes into the one that stops them, and books what that takes.
  void hold(double h, const StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
    for (std::size_t n = 0; n < scene_.body.held.size(); ++n) {
      const int node = scene_.body.held[n];
      const VectorOf<Dim> balanced = -scene_.body.mass[node] * (scene_.gravity + state.v.col(node) / h);
      impulses.hold.col(static_cast<Eigen::Index>(n)) += h * (balanced - force_.col(node));
      force_.col(node) = balanced;
    }
  }

  const SceneOf<Dim>& scene_;
  InternalForces<Dim> forces_;
  PointsOf<Dim> force_;  // [N]
  Eigen::VectorXd inverse_mass_;
  ImpulseContact<Dim> contact_;
  bool is_between_;  // substeps take their forces between the places that the steps tell
  double most_substeps_;
  StateOf<Dim> start_;
  StiffestMode mode_at_rest_{};  // of the body at rest
  double shortest_edge_ = 0;     // [m]
  StepWork work_;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_explicit_stepper(const SceneOf<Dim>& scene, double most_substeps) {
  return std::make_unique<ExplicitStepper<Dim>>(scene, most_substeps);
}
template std::unique_ptr<StepperOf<2>> make_explicit_stepper<2>(const SceneOf<2>&, double);
template std::unique_ptr<StepperOf<3>> make_explicit_stepper<3>(const SceneOf<3>&, double);

}  // namespace hydrostat::physics

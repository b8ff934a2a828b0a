#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/dashpot_stages.h"
#include "physics/impulse_contact.h"
#include "physics/internal_forces.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr double kStepMargin = 0.8;  // of the linear stability bound
// Of a substep with the dashpots in stages, over one in which they go with the rest: by itself, and of each stage.
constexpr double kStagedCost = 1.5;
constexpr double kStageCost = 0.2;
constexpr int kMostStages = 15;
constexpr double kWorth = 2;  // of the cost without stages over that with them
// Contact's forces come to what is lacking in 1 / phi substeps, of dashpots of rate d in about 1.4 h^2 d.
constexpr double kLate = 1.4;
constexpr double kLatest = 0.01;  // of the time in which the body falls by half its size
constexpr int kStiffeningPlacings = 2;  // what looking for the dashpots' stiffening once costs

struct StiffestMode {
  double damping;            // [1/s]
  double frequency_squared;  // [1/s2]
};
struct StiffestModes {
  StiffestMode together;  // where dashpots go with the rest
  StiffestMode apart;     // the largest damping and the largest frequency of all modes
};

double longest_substep(const StiffestMode& mode) {
  return 4 / (std::sqrt(mode.damping * mode.damping + 4 * mode.frequency_squared) + mode.damping);
}

/// The modes that limit the substep h of the linear motion about the rest shape. Together: while 4 M - 2 h D - h^2 K stays positive,
/// the roots of the amplification polynomial stay in the unit disc. The dashpots act along edges alone, the stiffest modes
/// are those of volume: with D itself the bound is several times longer than with D = (largest damping time) K. With the dashpots
/// in stages the masses grow to M / phi, and what is left of 4 M / phi - 2 h D is nowhere less than 4 M: K alone limits h.
template <int Dim>
StiffestModes stiffest_modes_at_rest(const BodyOf<Dim>& body, const InternalForces<Dim>& forces) {
  SystemMatrixOf<Dim> stiffness(body), damping(body);
  stiffness.set_zero();
  forces.add_stiffness(body.rest, 1, stiffness);
  damping.set_zero();
  damping.add_damping(body, body.rest, 1);
  Eigen::VectorXd root_mass(Dim * body.node_count());
  for (int i = 0; i < body.node_count(); ++i) root_mass.segment<Dim>(Dim * i).setConstant(std::sqrt(body.mass[i]));
  Eigen::VectorXd y(root_mass.size()), kz(y.size()), dz(y.size());
  // Power iteration by Rayleigh's quotient on what `combine` makes of M^-1 K and M^-1 D.
  const auto iterate = [&](const auto& combine) {
    for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = std::cos(1.7 * static_cast<double>(i * i % 97));
    StiffestMode mode{};
    for (int k = 0; k < 300; ++k) {
      y.normalize();
      const Eigen::VectorXd z = y.cwiseQuotient(root_mass);
      kz = (stiffness.lower().template selfadjointView<Eigen::Lower>() * z).cwiseQuotient(root_mass);
      dz = (damping.lower().template selfadjointView<Eigen::Lower>() * z).cwiseQuotient(root_mass);
      mode = {y.dot(dz), y.dot(kz)};
      combine(mode);
    }
    return mode;
  };
  // (2 h D + h^2 K) / 4, while h follows the largest eigenvalue toward 1.
  const StiffestMode together = iterate([&](const StiffestMode& mode) {
    const double h = longest_substep(mode);
    y = 2 * h * dz + h * h * kz;
  });
  if (together.damping == 0) return {together, together};
  const double most_damped = iterate([&](const StiffestMode&) { y = dz; }).damping;
  const double fastest = iterate([&](const StiffestMode&) { y = kz; }).frequency_squared;
  return {together, {most_damped, fastest}};
}

/// Symplectic Euler (velocity Verlet with velocities at half steps) with contact by impulses.
///
/// Internal forces are pairwise and taken at the positions from which the step starts, so linear and angular momentum
/// change by the booked impulses alone, to rounding. Contact is solved on the velocity that moves the body: a point at gap g
/// may approach with g / h at most; projected Gauss-Seidel over the points inside Coulomb's cone (Moreau's time stepping).
/// Dashpots that would ask for much shorter substeps than the rest go in stages (DashpotStages), and contact with them: its last
/// impulses act as forces all through the substep. As impulses alone they would stop a node and not what the dashpots tie to it,
/// and feet would slide.
/// Source: Hairer, Lubich, Wanner, "Geometric numerical integration", 2006, eq. (I.1.9) and, with velocities at half steps,
/// (I.1.17); Jean, "The non-smooth contact dynamics method", CMAME 177, 1999, for contact.
template <int Dim>
class ExplicitStepper final : public StepperOf<Dim> {
 public:
  ExplicitStepper(const SceneOf<Dim>& scene, double most_substeps)
      : scene_(scene),
        forces_(scene.body, scene.threads),
        force_(Dim, scene.body.node_count()),
        weight_(Dim, scene.body.node_count()),
        inverse_mass_(scene.body.mass.cwiseInverse()),
        contact_(scene),
        is_between_(!scene.body.elements.empty()),
        most_substeps_(most_substeps) {
    at_rest_ = stiffest_modes_at_rest(scene.body, forces_);
    if (at_rest_.apart.damping > 0) dashpots_.emplace(scene.body);
    shortest_edge_ = scene.body.rest_length.minCoeff();
    const double gravity = scene.gravity.norm() > 0 ? scene.gravity.norm() : 9.81;
    latest_ = kLatest * std::sqrt(size_of_volume<Dim>(scene.body.rest_volume.sum()) / gravity);
  }

  double substep(double dt) const override { return dt / std::ceil(dt / (is_staged(dt) ? staged_substep(dt, 1, 1) : plain_substep(1))); }

  StepWork work() const override {
    StepWork work = work_;
    work.by_impulses = contact_.work();
    return work;
  }

  bool shorten(int times) override {
    shorter_ = times;
    return true;
  }

  void forget() override { contact_.forget(); }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    if (!forces_.set_activation(activation)) return Termination::kDiverged;
    start_ = state;
    // The bound at rest, shortened by as much as the shape from which the step starts is stiffer.
    const bool is_in_stages = is_staged(dt);
    const double stiffer = forces_.stiffening(state.x), more_damped = is_in_stages ? dashpots_->stiffening(state.x) : 1;
    const double longest = is_in_stages ? staged_substep(dt, stiffer, more_damped) : plain_substep(stiffer);
    const double count = std::ceil(shorter_ * dt / longest);
    if (!(count <= most_substeps_)) return Termination::kDiverged;
    const int substeps = static_cast<int>(count);
    work_.passes += substeps;
    work_.rounds += substeps;
    const double h = dt / substeps;
    const int stages = is_in_stages ? stages_for(h, more_damped) : 0;
    if (is_in_stages) {
      work_.stages += substeps * stages;
      work_.placings += substeps + kStiffeningPlacings;
      weight_.noalias() = scene_.gravity * scene_.body.mass.transpose();
    }
    clear(impulses);
    contact_.forget_reach();
    begin_between(h, state, impulses);
    for (int s = 0; s < substeps; ++s) {
      force_.setZero();
      is_in_stages ? forces_.add_elastic_forces(state.x, force_) : forces_.add_forces(state, force_);
      if (effect_force != nullptr) {
        force_ += *effect_force;
        impulses.effect_nodes += h * *effect_force;
        for (int i = 0; i < scene_.body.node_count(); ++i) {
          impulses.effect_moment += h * cross<Dim>(state.x.col(i), effect_force->col(i));
        }
      }
      if (is_in_stages) {
        if (contact_.is_needed()) contact_.add_last_forces(h, state, force_, impulses);
        force_ += weight_;  // which the dashpots of held nodes brake
        dashpots_->add_mean_forces(state.x, state.v, h, stages, force_);
        force_ -= weight_;
      }
      hold(h, state, impulses);
      const double before = is_in_stages ? std::sqrt(state.v.colwise().squaredNorm().maxCoeff()) : 0;  // contact's last forces may have stopped it
      double fastest = 0;
      for (int i = 0; i < scene_.body.node_count(); ++i) {
        state.v.col(i) += h * (inverse_mass_[i] * force_.col(i) + scene_.gravity);
        const double speed_squared = state.v.col(i).squaredNorm();
        if (speed_squared > fastest || std::isnan(speed_squared)) fastest = speed_squared;  // which stays what is not a number
      }
      impulses.gravity_moment += h * cross<Dim>(state.x * scene_.body.mass, scene_.gravity);
      const double farthest = h * std::sqrt(fastest);
      if (!(farthest < shortest_edge_)) {
        state = start_;
        contact_.forget();
        return Termination::kDiverged;
      }
      if (contact_.is_needed()) contact_.push_apart(h, std::max(before, std::sqrt(fastest)), state, impulses);
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
  // Substeps [s] with a margin, where the body is so many times stiffer and its dashpots so many times as strong as at rest.
  double plain_substep(double stiffer) const {
    return kStepMargin * hydrostat::physics::longest_substep({at_rest_.together.damping, stiffer * at_rest_.together.frequency_squared});
  }
  double substep_in_stages(int stages, double stiffer, double more_damped) const {
    const double damping = more_damped * at_rest_.apart.damping;
    double h = kStepMargin * std::min(2 / std::sqrt(stiffer * at_rest_.apart.frequency_squared), DashpotStages<Dim>::reach(stages) / damping);
    if (contact_.is_needed()) h = std::min(h, std::sqrt(latest_ / (kLate * damping)));
    return h;
  }
  double staged_substep(double dt, double stiffer, double more_damped) const {
    return substep_in_stages(cheapest_stages(dt, stiffer, more_damped), stiffer, more_damped);
  }

  /// Of a step of dt [s], in plain substeps.
  double cost(int stages, double dt, double stiffer, double more_damped) const {
    return (kStagedCost + kStageCost * stages) * std::ceil(dt / substep_in_stages(stages, stiffer, more_damped));
  }
  int cheapest_stages(double dt, double stiffer, double more_damped) const {
    int best = 3;
    for (int stages = 5; stages <= kMostStages; stages += 2) {
      if (cost(stages, dt, stiffer, more_damped) < cost(best, dt, stiffer, more_damped)) best = stages;
    }
    return best;
  }
  bool is_staged(double dt) const {
    return dashpots_ && kWorth * cost(cheapest_stages(dt, 1, 1), dt, 1, 1) < std::ceil(dt / plain_substep(1));
  }
  /// As few as a substep of h [s] asks for.
  int stages_for(double h, double more_damped) const {
    int stages = 3;
    while (stages < kMostStages && kStepMargin * DashpotStages<Dim>::reach(stages) < h * more_damped * at_rest_.apart.damping) stages += 2;
    return stages;
  }

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
  PointsOf<Dim> force_;         // [N]
  PointsOf<Dim> weight_;        // [N]
  Eigen::VectorXd inverse_mass_;
  ImpulseContact<Dim> contact_;
  std::optional<DashpotStages<Dim>> dashpots_;  // where there are any
  bool is_between_;  // substeps take their forces between the places that the steps tell
  double most_substeps_;
  int shorter_ = 1;  // than the bound asks for
  StateOf<Dim> start_;
  StiffestModes at_rest_{};
  double shortest_edge_ = 0;  // [m]
  double latest_ = 0;         // [s] that contact's forces may come late
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

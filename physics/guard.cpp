#include <algorithm>
#include <cmath>

#include "physics/elastic_forces.h"
#include "physics/internal_forces.h"
#include "physics/recovery.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr double kFaster = 1.25;  // kinetic energy over that at the start and the work [-]: less is not looked into
constexpr double kCalm = 0.01;    // of the energy of a body as fast as push_out_speed: less is never too much
constexpr int kMostHalvings = 6;  // of euler's step where its solver finds no end
// Near the bound of stability energy may grow unseen before it is too much: once it was, less is.
constexpr double kWary = 0.5;           // [s] for which substeps stay as short as a step needed
constexpr double kWarilyGrown = 0.002;  // of the energy [-] in a step, where shorter substeps are left to be tried

/// An accurate method with euler behind it: sound steps are the accurate method's own, to the bit.
///
/// What is unsound is first tried again in shorter steps of the accurate method. Its substeps, if it has any, then stay short for a
/// while, or the instability that they cured would grow again, unseen until it is large, whenever they were let go.
///
/// What takes over is the whole step, not a blend of both: backward Euler damps, finds back from inverted and collapsed
/// shapes and keeps linear momentum. What angular momentum it loses in flight, a fault of its
/// own, a turn of the whole body gives back (ImpulsesOf::correction_nodes), as far as the energy that it took away reaches; a
/// turn about the centre of mass has no momentum, so that what is booked goes on to balance.
/// Source: Dinev, Liu, Kavan, "Stabilizing integrators for real-time physics", TOG 37(1), 2018, section 4, whose measure of
/// soundness is the energy, too.
template <int Dim>
class GuardedStepper final : public StepperOf<Dim> {
 public:
  GuardedStepper(const SceneOf<Dim>& scene, std::unique_ptr<StepperOf<Dim>> accurate, const GuardOptions& options)
      : scene_(scene),
        accurate_(std::move(accurate)),
        options_(options),
        forces_(scene.body),
        start_{scene.body.rest, scene.body.rest},
        part_(make_impulses(scene)),
        place_(scene.body.rest),
        calm_energy_(kCalm * 0.5 * scene.body.mass.sum() * std::pow(push_out_speed(scene), 2)),
        has_substeps_(accurate_->shorten(1)) {}

  double substep(double dt) const override { return accurate_->substep(dt); }
  long guard_steps() const override { return guard_steps_; }
  StepWork work() const override { return euler_ == nullptr ? accurate_->work() : accurate_->work() + euler_->work(); }
  void forget() override {
    accurate_->forget();
    if (euler_ != nullptr) euler_->forget();
    starts_unknown_ = true;
    is_guarding_ = false;
    least_parts_ = 1;
    wary_s_ = 0;
  }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    start_ = state;
    const bool is_broken = (euler_ != nullptr && euler_->is_recovering()) || (starts_unknown_ && has_inverted(state.x));
    starts_unknown_ = false;
    const int most_parts = is_guarding_ ? least_parts_ : options_.most_parts;
    for (int parts = least_parts_; !is_broken && parts <= most_parts; parts *= 2) {
      if (parts > least_parts_) accurate_->forget();
      const double passes = accurate_->work().passes, growth = is_wary() && parts < most_parts ? kWarilyGrown : options_.growth;
      if (step_accurately(parts, dt, activation, effect_force, state, impulses) == Termination::kDone &&
          is_sound(activation, state, impulses, dt / std::max(1.0, accurate_->work().passes - passes), growth)) {
        is_guarding_ = false;
        learn_from(parts, dt);
        return Termination::kDone;
      }
      state = start_;
    }
    return take_over(dt, activation, effect_force, state, impulses);
  }

 private:
  bool is_wary() const { return wary_s_ > 0; }
  /// That a step was sound in so many parts.
  void learn_from(int parts, double dt) {
    if (!has_substeps_) return;
    if (parts > least_parts_) {
      least_parts_ = parts;
      wary_s_ = kWary;
    } else if (is_wary() && (wary_s_ -= dt) <= 0 && least_parts_ > 1) {
      least_parts_ /= 2;
      wary_s_ = kWary;
    }
  }

  bool has_inverted(const PointsOf<Dim>& x) const {
    const BodyOf<Dim>& body = scene_.body;
    for (int t = 0; t < body.tet_count(); ++t) {
      double jacobian;
      jacobian_gradient<Dim>(x, body.tets, t, body.rest_volume[t], jacobian);
      if (!(jacobian > 0)) return true;
    }
    return false;
  }

  double kinetic_energy(const StateOf<Dim>& state) const {
    return 0.5 * state.v.colwise().squaredNorm().dot(scene_.body.mass);
  }

  Termination step_in_parts(StepperOf<Dim>& stepper, int parts, double dt, const Eigen::VectorXd& activation,
                            const PointsOf<Dim>* effect_force, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
    if (parts == 1) return stepper.step(dt, activation, effect_force, state, impulses);
    clear(impulses);
    for (int k = 0; k < parts; ++k) {
      if (stepper.step(dt / parts, activation, effect_force, state, part_) != Termination::kDone)
        return Termination::kDiverged;
      add(part_, impulses);
    }
    return Termination::kDone;
  }

  Termination step_accurately(int parts, double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force,
                              StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
    if (has_substeps_) accurate_->shorten(parts);
    return step_in_parts(*accurate_, has_substeps_ ? 1 : parts, dt, activation, effect_force, state, impulses);
  }

  /// From the step's start to `state` [J], of what comes from without.
  double work_on_body(const StateOf<Dim>& state, const ImpulsesOf<Dim>& impulses) const {
    const double work = scene_.gravity.dot((state.x - start_.x) * scene_.body.mass) + impulses.obstacle_work;
    return work + 0.5 * impulses.effect_nodes.cwiseProduct(start_.v + state.v).sum();
  }

  /// Adds the turn about the centre of mass that takes the angular momentum to what the start and the booked moments make
  /// it, as far as the energy stays below the start's and the work. It is booked as a correction.
  void turn_on(const Eigen::VectorXd& activation, ImpulsesOf<Dim>& impulses, StateOf<Dim>& state) {
    const BodyOf<Dim>& body = scene_.body;
    const VectorOf<Dim> origin = VectorOf<Dim>::Zero(), centre = centre_of_mass(body, state.x);
    const SpinOf<Dim> missing = angular_momentum(body, start_.x, start_.v, origin) + impulses.gravity_moment +
                                impulses.effect_moment - angular_momentum(body, state.x, state.v, origin);
    const SpinOf<Dim> rate = inertia(body, state.x, centre).ldlt().solve(missing);
    if (!rate.allFinite() || !forces_.set_activation(activation)) return;
    const double spare = kinetic_energy(start_) + forces_.elastic_energy(start_.x) + work_on_body(state, impulses) -
                         kinetic_energy(state) - forces_.elastic_energy(state.x);
    if (!(spare > 0)) return;
    // A part s of the turn brings in s b + s^2 a.
    const double a = 0.5 * rate.dot(missing), b = rate.dot(angular_momentum(body, state.x, state.v, centre));
    const double part = a + b <= spare ? 1 : 2 * spare / (b + std::sqrt(b * b + 4 * a * spare));
    for (int i = 0; i < body.node_count(); ++i) {
      const VectorOf<Dim> turn = turning<Dim>(part * rate, state.x.col(i) - centre);
      state.v.col(i) += turn;
      impulses.correction_nodes.col(i) += body.mass[i] * turn;
    }
  }

  /// Of elastic forces [J]. Between staggered places and velocities it swings with every mode, up to fourfold near the bound of
  /// stability; what stays as it is in any linear body is the mean of both places around the velocity, x- and x+, as a product:
  /// x- . K x+ / 2 = 2 E((x- + x+) / 2) - (E(x-) + E(x+)) / 2. Source: Hairer, Lubich, Wanner, "Geometric numerical
  /// integration", 2006, section I.1.4 and IX.3 (the modified energy of the Stoermer-Verlet scheme).
  double elastic_energy(const StateOf<Dim>& state, double substep) {
    if (!options_.is_staggered) return forces_.elastic_energy(state.x);
    const double half = 0.5 * substep, behind = scene_.body.elements.empty() ? -half : 0;  // of the middle, from the places that are told
    const auto energy_after = [&](double seconds) {
      place_ = state.x + seconds * state.v;
      return forces_.elastic_energy(place_);
    };
    return 2 * energy_after(behind) - 0.5 * (energy_after(behind - half) + energy_after(behind + half));
  }

  bool is_sound(const Eigen::VectorXd& activation, const StateOf<Dim>& state, const ImpulsesOf<Dim>& impulses, double substep,
                double growth) {
    const double before = kinetic_energy(start_), after = kinetic_energy(state);
    const double work = work_on_body(state, impulses);
    if (!std::isfinite(after) || has_inverted(state.x)) return false;
    if (!is_wary() && after <= kFaster * before + std::max(0.0, work) + calm_energy_) return true;
    if (!forces_.set_activation(activation)) return false;
    const double gain = after + elastic_energy(state, substep) - before - elastic_energy(start_, substep);
    return gain <= work + growth * (before + forces_.elastic_energy(start_.x)) + calm_energy_;
  }

  Termination take_over(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                        ImpulsesOf<Dim>& impulses) {
    if (euler_ == nullptr) euler_ = std::make_unique<RecoveringStepper<Dim>>(scene_, make_euler_stepper(scene_));
    ++guard_steps_;
    starts_unknown_ = true;
    for (int halvings = 0; halvings <= kMostHalvings; ++halvings) {
      if (!is_guarding_ || halvings > 0) euler_->forget();
      if (step_in_parts(*euler_, 1 << halvings, dt, activation, effect_force, state, impulses) == Termination::kDone) {
        if (scene_.body.held.empty() && impulses.contact_nodes.isZero(0)) turn_on(activation, impulses, state);
        is_guarding_ = true;
        accurate_->forget();
        return Termination::kDone;
      }
      state = start_;
    }
    is_guarding_ = false;
    accurate_->forget();
    return Termination::kDiverged;
  }

  const SceneOf<Dim>& scene_;
  std::unique_ptr<StepperOf<Dim>> accurate_;
  std::unique_ptr<RecoveringStepper<Dim>> euler_;  // from its first step on
  GuardOptions options_;
  InternalForces<Dim> forces_;
  StateOf<Dim> start_;
  ImpulsesOf<Dim> part_;
  PointsOf<Dim> place_;  // [m]
  double calm_energy_;          // [J]
  const bool has_substeps_;     // of its own, so that parts are shorter ones of these
  int least_parts_ = 1;         // in which the next step is tried
  double wary_s_ = 0;           // for which it stays so
  bool starts_unknown_ = true;  // whether the state from which the next step starts is sound
  bool is_guarding_ = false;    // the last step was euler's
  long guard_steps_ = 0;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_guarded_stepper(const SceneOf<Dim>& scene, std::unique_ptr<StepperOf<Dim>> accurate,
                                                     const GuardOptions& options) {
  return std::make_unique<GuardedStepper<Dim>>(scene, std::move(accurate), options);
}
template std::unique_ptr<StepperOf<2>> make_guarded_stepper<2>(const SceneOf<2>&, std::unique_ptr<StepperOf<2>>,
                                                               const GuardOptions&);
template std::unique_ptr<StepperOf<3>> make_guarded_stepper<3>(const SceneOf<3>&, std::unique_ptr<StepperOf<3>>,
                                                               const GuardOptions&);

}  // namespace hydrostat::physics

#include <algorithm>
#include <cmath>

#include "physics/elastic_forces.h"
#include "physics/internal_forces.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr double kFaster = 1.25;   // kinetic energy over that at the start and the work [-]: less is not looked into
constexpr double kCalm = 0.01;     // of the energy of a body as fast as push_out_speed: less is never too much
constexpr int kMostHalvings = 6;   // of euler's step where its solver finds no end

/// The booked impulses of a step's parts, summed.
template <int Dim>
void add(const ImpulsesOf<Dim>& part, ImpulsesOf<Dim>& sum) {
  sum.contact += part.contact;
  sum.contact_nodes += part.contact_nodes;
  sum.contact_moment += part.contact_moment;
  sum.effect_nodes += part.effect_nodes;
  sum.effect_moment += part.effect_moment;
  sum.gravity_moment += part.gravity_moment;
  sum.hold += part.hold;
  sum.internal_nodes += part.internal_nodes;
  sum.obstacle_work += part.obstacle_work;
}

/// An accurate method with euler behind it: sound steps are the accurate method's own, to the bit.
///
/// What takes over is the whole step, not a blend of both: backward Euler damps, finds back from inverted and collapsed shapes
/// and keeps linear momentum; the angular momentum that it loses is its own.
/// Source: Dinev, Liu, Kavan, "Stabilizing integrators for real-time physics", TOG 37(1), 2018, section 4, whose measure of
/// soundness is the energy, too.
template <int Dim>
class GuardedStepper final : public StepperOf<Dim> {
 public:
  GuardedStepper(const SceneOf<Dim>& scene, std::unique_ptr<StepperOf<Dim>> accurate, double growth)
      : scene_(scene),
        accurate_(std::move(accurate)),
        growth_(growth),
        forces_(scene.body),
        start_{scene.body.rest, scene.body.rest},
        calm_energy_(kCalm * 0.5 * scene.body.mass.sum() * std::pow(push_out_speed(scene), 2)) {}

  double substep(double dt) const override { return accurate_->substep(dt); }
  long guard_steps() const override { return guard_steps_; }
  void forget() override {
    accurate_->forget();
    starts_unknown_ = true;
  }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    start_ = state;
    const bool is_inverted = starts_unknown_ && has_inverted(state.x);
    starts_unknown_ = false;
    if (!is_inverted && accurate_->step(dt, activation, effect_force, state, impulses) == Termination::kDone &&
        is_sound(activation, state, impulses)) {
      is_guarding_ = false;
      return Termination::kDone;
    }
    state = start_;
    return take_over(dt, activation, effect_force, state, impulses);
  }

 private:
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

  bool is_sound(const Eigen::VectorXd& activation, const StateOf<Dim>& state, const ImpulsesOf<Dim>& impulses) {
    const double before = kinetic_energy(start_), after = kinetic_energy(state);
    double work = scene_.gravity.dot((state.x - start_.x) * scene_.body.mass) + impulses.obstacle_work;
    work += 0.5 * impulses.effect_nodes.cwiseProduct(start_.v + state.v).sum();
    if (!std::isfinite(after) || has_inverted(state.x)) return false;
    if (after <= kFaster * before + std::max(0.0, work) + calm_energy_) return true;
    if (!forces_.set_activation(activation)) return false;
    const double elastic = forces_.elastic_energy(start_.x), gain = after + forces_.elastic_energy(state.x) - before - elastic;
    return gain <= work + growth_ * (before + elastic) + calm_energy_;
  }

  Termination take_over(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                        ImpulsesOf<Dim>& impulses) {
    if (euler_ == nullptr) {
      euler_ = make_euler_stepper(scene_);
      part_ = impulses;
    }
    ++guard_steps_;
    starts_unknown_ = true;
    for (int halvings = 0; halvings <= kMostHalvings; ++halvings) {
      if (!is_guarding_ || halvings > 0) euler_->forget();
      const int parts = 1 << halvings;
      clear(impulses);
      Termination termination = Termination::kDone;
      for (int k = 0; k < parts && termination == Termination::kDone; ++k) {
        termination = euler_->step(dt / parts, activation, effect_force, state, part_);
        add(part_, impulses);
      }
      if (termination == Termination::kDone) {
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
  std::unique_ptr<StepperOf<Dim>> accurate_, euler_;  // euler from its first step on
  double growth_;  // of the energy [-] in a step beyond the work on the body
  InternalForces<Dim> forces_;
  StateOf<Dim> start_;
  ImpulsesOf<Dim> part_;
  double calm_energy_;          // [J]
  bool starts_unknown_ = true;  // whether the state from which the next step starts is sound
  bool is_guarding_ = false;    // the last step was euler's
  long guard_steps_ = 0;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_guarded_stepper(const SceneOf<Dim>& scene, std::unique_ptr<StepperOf<Dim>> accurate,
                                                     double growth) {
  return std::make_unique<GuardedStepper<Dim>>(scene, std::move(accurate), growth);
}
template std::unique_ptr<StepperOf<2>> make_guarded_stepper<2>(const SceneOf<2>&, std::unique_ptr<StepperOf<2>>, double);
template std::unique_ptr<StepperOf<3>> make_guarded_stepper<3>(const SceneOf<3>&, std::unique_ptr<StepperOf<3>>, double);

}  // namespace hydrostat::physics

#pragma once

#include <limits>
#include <type_traits>

#include "tests/physics/deepest_place.h"
#include "tests/physics/lattice_scene.h"
#include "tests/sanitizers.h"

namespace hydrostat::physics {

template <int D, Method M>
struct Case {
  static constexpr int kDim = D;
  static constexpr Method kMethod = M;
};
struct CaseName {
  template <typename Type>
  static std::string GetName(int) {
    return name_of(Type::kMethod) + std::to_string(Type::kDim) + "d";
  }
};
using PlaneCases = testing::Types<Case<2, Method::kExplicit>, Case<2, Method::kImplicit>, Case<2, Method::kEuler>,
                                  Case<2, Method::kXpbd>, Case<2, Method::kSpring>>;
using AllCases = testing::Types<Case<2, Method::kExplicit>, Case<3, Method::kExplicit>, Case<2, Method::kImplicit>,
                                Case<3, Method::kImplicit>, Case<2, Method::kEuler>, Case<3, Method::kEuler>,
                                Case<2, Method::kXpbd>, Case<3, Method::kXpbd>, Case<2, Method::kSpring>, Case<3, Method::kSpring>>;
/// A typed test on Case types whose body, a function of `Dim` and `method`, is compiled once a dimension, not once a case.
#define METHOD_TEST(Suite, Name)                                       \
  template <int Dim>                                                   \
  void Suite##Name(Method method);                                     \
  TYPED_TEST(Suite, Name) {                                            \
    Suite##Name<TypeParam::kDim>(TypeParam::kMethod);                  \
  }                                                                    \
  template <int Dim>                                                   \
  void Suite##Name([[maybe_unused]] Method method)

/// Every method in both dimensions; with sanitizers in the plane, from the same sources.
using Cases = std::conditional_t<kSanitized, PlaneCases, AllCases>;

/// For drafts: as stable as the others, but its elasticity is not to be trusted to a few percent.
inline bool is_draft(Method method) { return method == Method::kXpbd || method == Method::kSpring; }

/// Change of the velocity of the centre of mass that nothing booked explains [m/s].
inline double linear_tolerance(Method method) { return method == Method::kXpbd ? 1e-6 : 1e-9; }

/// What the method may lose of angular momentum in a step of a body about a metre long, over its mass [m2/s].
inline double angular_tolerance(Method method) {
  switch (method) {
    case Method::kExplicit: return 1e-12;  // rounding
    case Method::kImplicit: return 1e-6;   // what its solver leaves
    case Method::kSpring: return 1e-12;
    case Method::kEuler:
    case Method::kXpbd: break;
  }
  return std::numeric_limits<double>::infinity();  // its own, told in its header
}

/// Steps a scene with one method, the first few with sanitizers, and gives each step to `look(before, after, impulses)`.
template <int Dim, typename Look>
StateOf<Dim> simulate(Method method, const SceneOf<Dim>& scene, StateOf<Dim> state, double dt, int steps, const Look& look) {
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  const Eigen::VectorXd ones = passive(scene.body);
  for (int k = 0; k < few_steps(steps); ++k) {
    const StateOf<Dim> before = state;
    const Termination termination = stepper->step(dt, ones, nullptr, state, impulses);
    EXPECT_TRUE(termination == Termination::kDone) << "diverged in step " << k;
    if (termination != Termination::kDone) break;
    look(before, state, impulses);
  }
  return state;
}

/// By how much the change of momentum differs from what was booked, over m g.
template <int Dim>
double momentum_residual(const SceneOf<Dim>& scene, const StateOf<Dim>& before, const StateOf<Dim>& after,
                         const ImpulsesOf<Dim>& impulses, double dt) {
  const BodyOf<Dim>& body = scene.body;
  const double mass = body.mass.sum();
  const VectorOf<Dim> booked =
      impulses.contact.rowwise().sum() + impulses.effect_nodes.rowwise().sum() + dt * mass * scene.gravity;
  return (momentum(body, after.v) - momentum(body, before.v) - booked).norm() / (dt * mass * 9.81);
}

/// The turn by `degrees` that takes the x axis toward the y axis.
template <int Dim>
BlockOf<Dim> tilt(double degrees) {
  const double angle = degrees * 3.14159265358979323846 / 180;
  return turn_to<Dim>(vec<Dim>(-std::sin(angle), std::cos(angle), 0));
}

}  // namespace hydrostat::physics

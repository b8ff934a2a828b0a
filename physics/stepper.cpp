#include "physics/stepper.h"

#include "physics/recovery.h"

namespace hydrostat::physics {
namespace {

constexpr GuardOptions kExplicitGuard{.growth = 0.05, .most_parts = 4, .is_staggered = true};
constexpr GuardOptions kImplicitGuard{.growth = 0.5, .most_parts = 4};

}  // namespace

std::string name_of(Method method) {
  switch (method) {
    case Method::kExplicit:
      return "explicit";
    case Method::kEuler:
      return "euler";
    case Method::kImplicit:
      return "implicit";
    case Method::kXpbd:
      return "xpbd";
    case Method::kSpring:
      return "spring";
  }
  return {};
}

std::optional<Method> method_named(const std::string& name) {
  for (const Method method : kMethods) {
    if (name_of(method) == name) return method;
  }
  return std::nullopt;
}

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_stepper(Method method, const SceneOf<Dim>& scene) {
  switch (method) {
    case Method::kExplicit:
      return make_guarded_stepper(scene, make_explicit_stepper(scene), kExplicitGuard);
    case Method::kEuler:
      return std::make_unique<RecoveringStepper<Dim>>(scene, make_euler_stepper(scene));
    case Method::kImplicit:
      return make_guarded_stepper(scene, make_implicit_stepper(scene), kImplicitGuard);
    case Method::kXpbd:
      return make_xpbd_stepper(scene);
    case Method::kSpring:
      return make_spring_stepper(scene);
  }
  return nullptr;
}

template std::unique_ptr<StepperOf<2>> make_stepper<2>(Method, const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_stepper<3>(Method, const SceneOf<3>&);

}  // namespace hydrostat::physics
